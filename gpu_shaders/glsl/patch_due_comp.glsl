/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lists patches that are due, see patch_due_lib, and notes the number of samples that they get. Nobody waits for that
 * note: a patch is due for one list at most, whatever the note says.
 *
 * Dispatch: one group of 256 threads a block; y = lists, z = parts of the light. `due` has patch_count elements for
 * each list of each part, lists of one part after the other; elements of `due_counts` from `result` on are their
 * lengths.
 */

void note_class(int patch_index, int sample_class)
{
  ivec2 at = element_position(patch_index);
  vec4 value = vec4(float(sample_class));
  if (gl_WorkGroupID.z == 0u) {
    imageStore(classes0, at, value);
  }
#if PARTS > 1
  else if (gl_WorkGroupID.z == 1u) {
    imageStore(classes1, at, value);
  }
#endif
#if PARTS > 2
  else if (gl_WorkGroupID.z == 2u) {
    imageStore(classes2, at, value);
  }
#endif
#if PARTS > 3
  else if (gl_WorkGroupID.z == 3u) {
    imageStore(classes3, at, value);
  }
#endif
}

void main()
{
  int block = int(gl_WorkGroupID.x), sample_class = int(gl_WorkGroupID.y);
  int list = int(gl_WorkGroupID.z * gl_NumWorkGroups.y) + sample_class;
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
      note_class(patch_index, sample_class);
      place++;
    }
  }
}
