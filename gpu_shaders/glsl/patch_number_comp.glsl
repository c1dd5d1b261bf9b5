/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Numbers new patches in the order of their leaders and enters them in the table; second step of a compaction, see
 * compaction_lib.
 *
 * Dispatch: one group of 256 threads a block. total_in, total_out: number of patches before and after.
 */

void main()
{
  int block = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  int first = block * BLOCK + lane * RUN;
  int number = int(texelFetch(total_in, ivec2(0), 0).x) + count_before(block);
  ivec2 selected = count_selected(first);
  if (lane == 0 && block == int(gl_NumWorkGroups.x) - 1) {
    imageStore(total_out, ivec2(0), vec4(float(number + counts[255])));
  }
  number += selected.y;
  for (int i = 0; i < RUN; i++) {
    int hit = item(first + i);
    if (is_selected(hit)) {
      int slot = int(element(slots, hit).x);
      vec4 key = element(hit_keys, hit);
      imageStore(table, element_position(slot), uvec4(uint(number + 1)));
      imageStore(patch_keys, element_position(number), vec4(key.xyz, key.w * float(VARIANT_COUNT) + float(variant)));
      imageStore(patch_points, element_position(number * POINTS), element(hits, hit));
#ifdef HAS_SHEETS
      imageStore(patch_sheets, element_position(number), vec4(floor(key.w / LEVELS_AND_FACINGS)));
#endif
      number++;
    }
  }
}
