/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sets elements first .. first + count of a linear array to `value`, with TIMES taken times element `factor` of
 * `factors`; with INTEGERS the array holds unsigned ones.
 *
 * Dispatch: one thread an element; groups of 64.
 */

void main()
{
  int index = LINEAR_THREAD;
  if (index < count) {
#if defined(INTEGERS)
    imageStore(target, element_position(first + index), uvec4(value));
#elif defined(TIMES)
    imageStore(target, element_position(first + index), vec4(value * element(factors, factor).x));
#else
    imageStore(target, element_position(first + index), vec4(value));
#endif
  }
}
