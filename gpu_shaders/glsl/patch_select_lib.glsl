/* Which hits a compaction picks: those that lead a new patch, or those that are still without one. A compaction counts per block of BLOCK
 * entries (patch_count_comp), then places what it picked in order (patch_number_comp, patch_pending_comp): 256 threads a block, RUN
 * entries one after the other a thread. */

const int RUN = 16;
const int BLOCK = 256 * RUN;

SHARED_ int counts[256];

/* Hit of an entry of `items`, −1 past their end. */
int item_hit(int entry)
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

/* How many of this thread's entries are selected, and how many of the block's before it (`counts` of the last thread is the block's). */
ivec2 count_selected(int first)
{
  int lane = int(gl_LocalInvocationID.x);
  int own = 0;
  for (int i = 0; i < RUN; i++) {
    own += is_selected(item_hit(first + i)) ? 1 : 0;
  }
  counts[lane] = own;
  barrier();
  for (int stride = 1; stride < 256; stride *= 2) { /* Hillis and Steele 1986 */
    int before = lane >= stride ? counts[lane - stride] : 0;
    barrier();
    counts[lane] += before;
    barrier();
  }
  return ivec2(own, counts[lane] - own);
}
