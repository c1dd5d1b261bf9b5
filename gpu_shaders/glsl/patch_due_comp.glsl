/* Lists patches that are due, see patch_due_lib, and notes the number of samples that they get.
 *
 * Dispatch: one group of 256 threads a block. Element `result` of `due_counts` is their number.
 */

void main()
{
  int block = int(gl_WorkGroupID.x);
  int first = block * BLOCK + int(gl_LocalInvocationID.x) * RUN;
  int place = count_before(block);
  if (gl_LocalInvocationID.x == 0u && block == int(gl_NumWorkGroups.x) - 1) {
    imageStore(due_counts, element_position(result), vec4(float(place + int(element(block_counts, block).x))));
  }
  place += count_selected(first).y;
  for (int i = 0; i < RUN; i++) {
    int patch_index = item(first + i);
    if (is_selected(patch_index)) {
      imageStore(due, element_position(place), vec4(float(patch_index)));
      imageStore(classes, element_position(patch_index), vec4(float(sample_class)));
      place++;
    }
  }
}
