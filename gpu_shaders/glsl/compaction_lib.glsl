/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Compaction: entries that `is_selected` picks, in their order. A library before this one says what an entry stands for
 * (`item`, −1 past the end) and which are picked.
 *
 * compact_count_comp counts per block of BLOCK entries, where there is more than one, then a shader places what was
 * picked: 256 threads a block, RUN entries one after the other a thread. Groups of one y and z make one list.
 */

const int BLOCK = 256 * RUN;

SHARED_ int counts[256];

/* Among the blocks of all lists. */
int block_number(int block)
{
  uint list = gl_WorkGroupID.z * gl_NumWorkGroups.y + gl_WorkGroupID.y;
  return int(list * gl_NumWorkGroups.x) + block;
}

/* How many of this thread's entries are selected, and how many of the block's before it; counts[255] is then the
 * block's number. */
ivec2 count_selected(int first)
{
  int lane = int(gl_LocalInvocationID.x);
  int own = 0;
  for (int i = 0; i < RUN; i++) {
    own += is_selected(item(first + i)) ? 1 : 0;
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

#ifdef PLACES
SHARED_ int earlier[256];

/* Sum of the counts of all blocks of this list before `block`. */
int count_before(int block)
{
  int lane = int(gl_LocalInvocationID.x);
  int sum = 0;
  for (int i = lane; i < block; i += 256) {
    sum += int(element(block_counts, block_number(i)).x);
  }
  earlier[lane] = sum;
  barrier();
  for (int half_count = 128; half_count > 0; half_count /= 2) {
    if (lane < half_count) {
      earlier[lane] += earlier[lane + half_count];
    }
    barrier();
  }
  return earlier[0];
}
#endif
