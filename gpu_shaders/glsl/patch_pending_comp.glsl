/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lists the hits that are still without a patch, in order; second step of a compaction, see compaction_lib.
 *
 * Dispatch: one group of 256 threads a block.
 */

void main()
{
  int block = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  int first = block * BLOCK + lane * RUN;
  int place = count_before(block);
  ivec2 selected = count_selected(first);
  if (lane == 0 && block == int(gl_NumWorkGroups.x) - 1) {
    imageStore(total_out, ivec2(0), vec4(float(place + counts[255])));
  }
  place += selected.y;
  for (int i = 0; i < RUN; i++) {
    int hit = item(first + i);
    if (is_selected(hit)) {
      imageStore(pending, element_position(place), vec4(float(hit)));
      place++;
    }
  }
}
