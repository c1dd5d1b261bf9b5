/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where a misplaced probe could go: the nearest surface in each of the six faces.
 *
 * Dispatch: one group of 6 threads a probe of `slots`, one thread a face. Writes 6 elements a probe: offset to the
 * surface, its distance (NO_SURFACE where the face shows none).
 */

void main()
{
  int entry = int(gl_WorkGroupID.x);
  int face = int(gl_LocalInvocationID.x);
  int layer = int(element(slots, entry).x);
  vec4 nearest = vec4(0.0, 0.0, 0.0, NO_SURFACE);
  for (int i = 0; i < FACE * FACE; i++) {
    ivec2 texel = ivec2(i % FACE, face * FACE + i / FACE);
    float range = abs(texelFetch(geometry, ivec3(texel, layer), 0).z);
    if (range < nearest.w) {
      nearest = vec4(texel_direction(texel) * range, range);
    }
  }
  imageStore(exits, element_position(entry * 6 + face), nearest);
}
