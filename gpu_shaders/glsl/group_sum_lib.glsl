/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sums over the threads of a group, in fixed order, so that two runs give the same bytes. SUMS at a time: every thread
 * writes its share of sum i to partial_sums[i · GROUP + lane], then a barrier, then group_sum(i). */

SHARED_ vec4 partial_sums[SUMS * GROUP];

vec3 group_sum(int index)
{
  vec3 total = vec3(0.0);
  for (int i = 0; i < GROUP; i++) {
    total += partial_sums[index * GROUP + i].rgb;
  }
  return total;
}
