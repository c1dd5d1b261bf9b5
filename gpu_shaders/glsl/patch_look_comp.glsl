/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Hits join a patch that their cell has, the first whose leader they see; NO_PATCH where there is none.
 *
 * Dispatch: one thread a hit; groups of 64. Nobody founds a patch meanwhile. Reference: core/patches.py.
 */

int patch_with(vec4 key)
{
  int slot = int(cell_hash(key) & uint(table_mask));
  for (int step = 0; step <= table_mask; step++) {
    int owner = int(texelFetch(table, element_position(slot), 0).x) - 1;
    if (owner < 0 || element(patch_keys, owner) == key) {
      return owner;
    }
    slot = (slot + 1) & table_mask;
  }
  return -1;
}

void main()
{
  int hit = LINEAR_THREAD;
  if (hit >= hit_count || imageLoad(bound, element_position(hit)).x != PENDING) {
    return;
  }
  vec4 key = element(hit_keys, hit);
  float found = NO_PATCH;
  for (int variant = 0; variant < VARIANT_COUNT && found == NO_PATCH; variant++) {
    int patch_index = patch_with(vec4(key.xyz, key.w * float(VARIANT_COUNT) + float(variant)));
    if (patch_index < 0) {
      break;
    }
    if (sees(element(hits, hit), element(patch_points, POINTS * patch_index))) {
      found = float(patch_index);
    }
  }
  imageStore(bound, element_position(hit), vec4(found));
}
