/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Adds to `direct` of each patch of the lists of patch_lists_lib, or begins it with, the mean over its samples, whose
 * sums by runs of them patch_direct_comp left.
 *
 * Dispatch: one thread an entry of the lists; groups of 64.
 */

void main()
{
  Entry entry = entry_of_thread(LINEAR_THREAD);
  if (entry.list == LISTS) {
    return;
  }
  vec3 sum = vec3(0.0);
  for (int i = 0; i < runs_of(entry.list); i++) {
    sum += element(sums, entry.sums + i).rgb;
  }
  ivec2 target = element_position(patch_of(entry));
  vec4 before = begins != 0 ? vec4(0.0) : imageLoad(direct, target);
  imageStore(direct, target, before + vec4(sum / float(list_samples[entry.list]), 0.0));
}
