/* Where texels meet surfaces that reflect, as one linear array: position and packed normal, −1 where there is nothing to light.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Element of a texel: (probe · 6·FACE + row) · FACE + column, for
 * layer first_layer + probe.
 */

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 at = ivec3(id.xy, first_layer + id.z);
  vec4 seen = texelFetch(geometry, at, 0);
  vec4 hit = vec4(0.0, 0.0, 0.0, -1.0);
  if (seen.z < NO_SURFACE && texelFetch(albedo, at, 0).rgb != vec3(0.0)) {
    hit.xyz = element(probe_slots, first_slot + id.z).xyz + texel_direction(id.xy) * abs(seen.z);
    hit.w = pack_normal(seen.xy);
  }
  imageStore(hits, element_position((id.z * 6 * FACE + id.y) * FACE + id.x), hit);
}
