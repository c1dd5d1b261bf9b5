/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What compactions of a bind pick, see compaction_lib: hits without a patch; with LEADERS, those of them that lead a
 * new one. */

int item(int entry)
{
  if (entry >= (item_count < 0 ? hit_count : item_count)) {
    return -1;
  }
  return item_count < 0 ? entry : int(element(items, entry).x);
}

bool is_selected(int hit)
{
  if (hit < 0 || element(bound, hit).x != PENDING) {
    return false;
  }
#ifdef LEADERS
  int slot = int(element(slots, hit).x);
  return slot >= 0 && (imageLoad(table, element_position(slot)).x & CLAIM) != 0u &&
         imageLoad(leaders, element_position(slot)).x == uint(hit);
#else
  return true;
#endif
}
