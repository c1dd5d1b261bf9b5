/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Hits join the patch of their cell if they see its leader; that keeps a cell which a wall cuts in two from becoming
 * one patch.
 *
 * A texel that sees none of the VARIANTS leaders in its cell shows the last one's light, as it has to show some, but is
 * no point of it; a ray is left out of the mean of its patch.
 *
 * Dispatch: as patch_claim_comp. Who joins a patch of this bind competes for one of its points: the lowest of the hits'
 * scrambled numbers wins (`candidates`). Reference: core/patches.py.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= (item_count < 0 ? hit_count : item_count)) {
    return;
  }
  int hit = item_count < 0 ? entry : int(element(items, entry).x);
  if (imageLoad(bound, element_position(hit)).x != PENDING) {
    return;
  }
  int slot = int(element(slots, hit).x);
  if (slot < 0) {
    if (is_last != 0) {
      imageStore(bound, element_position(hit), vec4(NO_PATCH));
    }
    return;
  }
  int patch_index = int(texelFetch(table, element_position(slot), 0).x) - 1;
  bool leads = patch_index >= int(texelFetch(total_before, ivec2(0), 0).x) &&
               texelFetch(leaders, element_position(slot), 0).x == uint(hit);
  bool sees_leader = leads || sees(element(hits, hit), element(patch_points, POINTS * patch_index));
  if (!sees_leader) {
#ifdef HAS_VIEW
    if (is_last == 0) {
      return;
    }
#else
    if (is_last != 0) {
      imageStore(bound, element_position(hit), vec4(NO_PATCH));
    }
    return;
#endif
  }
  imageStore(bound, element_position(hit), vec4(float(patch_index)));
#ifdef HAS_VIEW
  imageStore(seen, element_position(patch_index), vec4(1.0));
#endif
  if (patch_index >= first_new && !leads && sees_leader) {
    int point = ((hit % row_length) & 3) + 4 * ((hit / row_length) & 3);
    imageAtomicMin(candidates, element_position(patch_index * POINTS + point), uint(hit) * 0x9E3779B1u);
  }
}
