/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which objects a probe sees, from which side and whether lit: 8×8 texels of each face, for core/orientation.py.
 *
 * Dispatch: one group of 96 threads a probe of the batch; each writes four texels: ±(object + 1), negative from behind,
 * half a unit farther from zero where light arrives or leaves; 0 background. Needs geometry, emission and patches with
 * direct light.
 */

void main()
{
  int probe = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  vec4 sighting = vec4(0.0);
  for (int i = 0; i < 4; i++) {
    int sample_index = lane * 4 + i;
    ivec2 cell = ivec2(sample_index & 7, (sample_index >> 3) & 7);
    int face = sample_index >> 6;
    ivec2 texel = (2 * cell + 1) * FACE / 16;
    ivec3 at = ivec3(texel.x, face * FACE + texel.y, probe);
    vec4 seen = texelFetch(geometry, at, 0);
    if (seen.z < NO_SURFACE) {
      vec3 light = texelFetch(emission, at, 0).rgb + texel_reflected(at, -1);
      float object = element(triangle_attributes, 5 * int(seen.w) + 1).w;
      float value = object + 1.0 + (light != vec3(0.0) ? 0.5 : 0.0);
      sighting[i] = seen.z < 0.0 ? -value : value;
    }
  }
  imageStore(sightings, element_position(probe * 96 + lane), sighting);
}
