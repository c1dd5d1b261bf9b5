/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Patches that are due to be lit by a part of the light, see compaction_lib: those that should have another number of
 * samples than they have, a list for each number. How many they should have: core/patches.py, direct_samples.
 *
 * spread: mean and standard deviation of one sample, if nothing stood between; lights and mean_lights: the mean that
 * all parts send to the patch and to all patches.
 */

int item(int entry)
{
  return entry < patch_count ? entry : -1;
}

bool is_selected(int patch_index)
{
  int sample_class = int(gl_WorkGroupID.y);
  if (patch_index < 0 || imageLoad(classes, element_position(patch_index)).x == float(sample_class)) {
    return false;
  }
  vec2 one = element(spread, patch_index).xy;
  float all = element(mean_lights, patch_index).x;
  float light = max(clamp(element(lights, patch_index).x, DARK * all, all), 1.0e-30);
  float error = sqrt(one.y * one.y + SHADOWED * one.x * one.x) / light;
  int wanted = error < ERRORS.x ? 0 : error < ERRORS.y ? 1 : error < ERRORS.z ? 2 : 3;
  return wanted == sample_class;
}
