/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Writes single elements of a linear array: the one at column and row places[i].xy of `target` becomes values[i].
 *
 * Dispatch: one thread a value; groups of 64.
 */

void main()
{
  int entry = int(gl_GlobalInvocationID.x);
  if (entry < value_count) {
    imageStore(target, ivec2(element(places, entry).xy), element(values, entry));
  }
}
