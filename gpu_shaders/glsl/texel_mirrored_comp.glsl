/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Puts together what texel_reflections_comp found with the patches `ends` on which its rays ended, and marks these as
 * seen.
 *
 * Dispatch: one thread a texel of texel_count from first_texel on; groups of 64; inputs count from first_texel.
 * mirrored, REFLECTIONS + 1 elements a texel: radiance that rays brought along; then for each ray by what part of the
 * irradiance it counts, and the patch that it is of, negative for none. Rays that end on no patch are left out of the
 * mean.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= texel_count) {
    return;
  }
  int counted = 0;
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    counted += element(ends, entry * REFLECTIONS + ray).x != -1.0 ? 1 : 0;
  }
  int first = (first_texel + entry) * (REFLECTIONS + 1);
  imageStore(mirrored, element_position(first), element(carried, entry));
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    float end = element(ends, entry * REFLECTIONS + ray).x;
    vec3 part = element(reflected, entry * REFLECTIONS + ray).rgb / float(max(counted, 1));
    imageStore(mirrored, element_position(first + 1 + ray), vec4(part, end));
    if (end >= 0.0) {
      imageStore(seen, element_position(int(end)), vec4(1.0));
    }
  }
}
