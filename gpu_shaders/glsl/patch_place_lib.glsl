/* Second step of a compaction: where the entries that a block selects belong. */

SHARED_ int earlier[256];

/* Sum of the counts of all blocks before `block`. */
int count_before(int block)
{
  int lane = int(gl_LocalInvocationID.x);
  int sum = 0;
  for (int i = lane; i < block; i += 256) {
    sum += int(element(block_counts, i).x);
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
