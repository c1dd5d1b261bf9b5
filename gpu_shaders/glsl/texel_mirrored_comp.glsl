/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Puts together what texel_reflections_comp found with the patches `ends` on which its rays ended, and marks these as
 * seen.
 *
 * entries: what entry each texel has in its inputs, negative where it is not glossy.
 * Dispatch: one thread a texel of texel_count from first_texel on; groups of 64; entries count from first_texel.
 * mirrored, REFLECTIONS + 1 elements a texel: radiance that rays brought along; then for each ray by what part of the
 * irradiance it counts, and the patch that it is of, negative for none. Rays that end on no patch are left out of the
 * mean.
 */

void main()
{
  int texel = LINEAR_THREAD;
  if (texel >= texel_count) {
    return;
  }
  int entry = int(element(entries, texel).x), first = (first_texel + texel) * (REFLECTIONS + 1), counted = 0;
  bool is_glossy = entry >= 0;
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    counted += is_glossy && element(ends, entry * REFLECTIONS + ray).x != -1.0 ? 1 : 0;
  }
  imageStore(mirrored, element_position(first), is_glossy ? element(carried, entry) : vec4(0.0));
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    float end = is_glossy ? element(ends, entry * REFLECTIONS + ray).x : -1.0;
    vec3 part = is_glossy ? element(reflected, entry * REFLECTIONS + ray).rgb / float(max(counted, 1)) : vec3(0.0);
    imageStore(mirrored, element_position(first + 1 + ray), vec4(part, end));
    if (end >= 0.0) {
      imageStore(seen, element_position(int(end)), vec4(1.0));
    }
  }
}
