/* SPDX-License-Identifier: GPL-3.0-or-later */
/* First step of a compaction, see compaction_lib: the number of selected entries of each block.
 *
 * Dispatch: one group of 256 threads a block; y and z = lists.
 */

void main()
{
  int block = int(gl_WorkGroupID.x);
  count_selected(block * BLOCK + int(gl_LocalInvocationID.x) * RUN);
  if (gl_LocalInvocationID.x == 255u) {
    imageStore(block_counts, element_position(block_number(block)), vec4(float(counts[255])));
  }
}
