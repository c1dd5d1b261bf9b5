/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Finds the cell of each hit in the table, enters cells that are missing and lets the lowest of their hits lead.
 *
 * Dispatch: one thread an entry of `items` (all hits where item_count is negative, hit_count of them); groups of 64.
 * slots: place in the table, −1 where that is full.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= (item_count < 0 ? hit_count : item_count)) {
    return;
  }
  int hit = item_count < 0 ? entry : int(element(items, entry).x);
  if (element(bound, hit).x != PENDING) {
    return;
  }
  vec4 key = element(hit_keys, hit);
  key.w = key.w * float(VARIANT_COUNT) + float(variant);
  int slot = int(cell_hash(key) & uint(table_mask));
  int result = -1;
  for (int step = 0; step <= table_mask; step++) {
    ivec2 place = element_position(slot);
    uint owner = imageLoad(table, place).x;
    if (owner == 0u) {
      owner = imageAtomicCompSwap(table, place, 0u, CLAIM | uint(hit));
      owner = owner == 0u ? CLAIM | uint(hit) : owner;
    }
    if (owner_key(owner, variant) == key) {
      result = slot;
      if ((owner & CLAIM) != 0u) {
        imageAtomicMin(leaders, place, uint(hit));
      }
      break;
    }
    slot = (slot + 1) & table_mask;
  }
  imageStore(slots, element_position(hit), vec4(float(result)));
}
