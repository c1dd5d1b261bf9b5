/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Second step of a compaction, see compaction_lib: lists what is selected, in order, and how much that is.
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
    int chosen = item(first + i);
    if (is_selected(chosen)) {
      imageStore(listed, element_position(place), vec4(float(chosen)));
      place++;
    }
  }
}
