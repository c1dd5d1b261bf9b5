/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Copies elements of a linear array.
 *
 * Dispatch: one thread an element; groups of 64. Element i of `source` goes to first + i of `target`.
 */

void main()
{
  int index = LINEAR_THREAD;
  if (index < count) {
    imageStore(target, element_position(first + index), texelFetch(source, element_position(index), 0));
  }
}
