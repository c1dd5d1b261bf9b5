/* Which objects a probe sees, and from which side: 8×8 texels of each face, for the vote on flipped normals (core/orientation.py).
 *
 * Dispatch: one group of 96 threads a probe of the batch; each writes four texels: ±(object + 1), negative from behind, 0 background.
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
    vec4 seen = texelFetch(geometry, ivec3(texel.x, face * FACE + texel.y, probe), 0);
    if (seen.z < NO_SURFACE) {
      sighting[i] = seen.z < 0.0 ? -1.0 - seen.w : 1.0 + seen.w;
    }
  }
  imageStore(sightings, ivec2((probe * 96 + lane) & 4095, (probe * 96 + lane) >> 12), sighting);
}
