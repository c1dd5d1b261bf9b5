/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Patches that are due to be lit by a part of the light, see compaction_lib: those that should have another number of
 * samples than they have, a list for each number. How many they should have: core/patches.py, direct_samples. The parts
 * take turns along z, PARTS of them, each with arrays of its own.
 *
 * spread: mean and standard deviation of one sample, if nothing stood between; lights and mean_lights: the mean that
 * all parts send to the patch and to all patches. classes: the number of samples that it has.
 */

vec2 spread_of(int patch_index)
{
#if PARTS > 1
  if (gl_WorkGroupID.z == 1u) {
    return element(spread1, patch_index).xy;
  }
#endif
#if PARTS > 2
  if (gl_WorkGroupID.z == 2u) {
    return element(spread2, patch_index).xy;
  }
#endif
#if PARTS > 3
  if (gl_WorkGroupID.z == 3u) {
    return element(spread3, patch_index).xy;
  }
#endif
  return element(spread0, patch_index).xy;
}

float class_of(int patch_index)
{
#if PARTS > 1
  if (gl_WorkGroupID.z == 1u) {
    return imageLoad(classes1, element_position(patch_index)).x;
  }
#endif
#if PARTS > 2
  if (gl_WorkGroupID.z == 2u) {
    return imageLoad(classes2, element_position(patch_index)).x;
  }
#endif
#if PARTS > 3
  if (gl_WorkGroupID.z == 3u) {
    return imageLoad(classes3, element_position(patch_index)).x;
  }
#endif
  return imageLoad(classes0, element_position(patch_index)).x;
}

int item(int entry)
{
  return entry < patch_count ? entry : -1;
}

bool is_selected(int patch_index)
{
  int sample_class = int(gl_WorkGroupID.y);
  if (patch_index < 0 || class_of(patch_index) == float(sample_class)) {
    return false;
  }
  vec2 one = spread_of(patch_index);
  float all = element(mean_lights, patch_index).x;
  float light = max(clamp(element(lights, patch_index).x, DARK * all, all), 1.0e-30);
  float error = sqrt(one.y * one.y + SHADOWED * one.x * one.x) / light;
  int wanted = error < ERRORS.x ? 0 : error < ERRORS.y ? 1 : error < ERRORS.z ? 2 : 3;
  return wanted == sample_class;
}
