/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Adds TERMS arrays to `total`, or begins with their sum; in their order.
 *
 * Dispatch: one thread a patch; groups of 64.
 */

void main()
{
  int index = LINEAR_THREAD;
  if (index >= patch_count) {
    return;
  }
  ivec2 place = element_position(index);
  vec4 sum = begins != 0 ? vec4(0.0) : imageLoad(total, place);
  sum += element(term0, index);
#if TERMS > 1
  sum += element(term1, index);
#endif
#if TERMS > 2
  sum += element(term2, index);
#endif
#if TERMS > 3
  sum += element(term3, index);
#endif
  imageStore(total, place, sum);
}
