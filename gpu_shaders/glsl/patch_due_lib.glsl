/* Patches that are due to be lit by a part of the light, see compaction_lib: those that should have number `sample_class` of samples and
 * have another one or none. How many they should have: core/patches.py, direct_samples.
 *
 * spread: mean and standard deviation over a patch's points, if nothing stood between; mean_lights: what they are held against.
 */

int item(int entry)
{
  return entry < patch_count ? entry : -1;
}

bool is_selected(int patch_index)
{
  if (patch_index < 0 || imageLoad(classes, element_position(patch_index)).x == float(sample_class)) {
    return false;
  }
  float error = element(spread, patch_index).y / ROOT_OF_SAMPLES / max(element(mean_lights, patch_index).x, 1.0e-30);
  int wanted = error < UNEVEN ? 0 : error < VERY_UNEVEN ? 1 : 2;
  return wanted == sample_class;
}
