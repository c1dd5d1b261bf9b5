/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Finds rays that keep light among a handful of patches for ever, and takes it away with the first of them.
 *
 * In a slit all rays of a patch end on the one across, and all of that one's back on it: none of so few found the way
 * out. Between white walls light would add up there without end, so one ray of each counts as lost, as if the next had
 * gone astray.
 * Dispatch: one thread a patch; groups of 64. Only first rays are written, and only by their own patch; others look at
 * the rest, so it does not matter who comes first. Reference: core/patches.py, caught.
 */

void main()
{
  int patch_index = LINEAR_THREAD;
  if (patch_index >= patch_count) {
    return;
  }
  int members[MOST_CAUGHT];
  members[0] = patch_index;
  int count = 1;
  for (int k = 0; k < count; k++) {
    int first = members[k] * rays_each;
    for (int i = first + (k > 0 ? 1 : 0); i < first + rays_each; i++) {
      int end = int(imageLoad(ray_ends, element_position(i)).x);
      if (end == NOTHING) {
        return;
      }
      bool is_known = end == NO_PATCH;
      for (int m = 0; m < count; m++) {
        is_known = is_known || end == members[m];
      }
      if (!is_known) {
        if (count == MOST_CAUGHT) {
          return;
        }
        members[count++] = end;
      }
    }
  }
  imageStore(ray_ends, element_position(patch_index * rays_each), vec4(float(NOTHING)));
}
