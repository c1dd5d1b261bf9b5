/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lists patches that are due, see patch_due_lib, and notes the number of samples that they get. Nobody waits for that
 * note: a patch is due for one list at most, whatever the note says.
 *
 * Dispatch: one group of 256 threads a block; y = lists, patch_count elements of `due` each. Elements of `due_counts`
 * from `result` on are their lengths.
 */

void main()
{
  int block = int(gl_WorkGroupID.x), list = int(gl_WorkGroupID.y);
  int first = block * BLOCK + int(gl_LocalInvocationID.x) * RUN;
  int place = count_before(block);
  ivec2 selected = count_selected(first);
  if (gl_LocalInvocationID.x == 0u && block == int(gl_NumWorkGroups.x) - 1) {
    imageStore(due_counts, element_position(result + list), vec4(float(place + counts[255])));
  }
  place += selected.y;
  for (int i = 0; i < RUN; i++) {
    int patch_index = item(first + i);
    if (is_selected(patch_index)) {
      imageStore(due, element_position(list * patch_count + place), vec4(float(patch_index)));
      imageStore(classes, element_position(patch_index), vec4(float(list)));
      place++;
    }
  }
}
