/* Where each texel surface reads the field and how much of each corner: constant while geometry stands still, so iterations need
 * no visibility test of their own.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Layer first_layer + probe of weights0 (corners 0..3),
 * weights1 (4..7) and the first corner's node in geometry.w; −1 where there is no surface.
 */

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 target = ivec3(id.xy, first_layer + id.z);
  vec4 seen = imageLoad(geometry, target);
  float weights[8] = float[8](0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
  float first_node = -1.0;
  if (seen.z < NO_SURFACE) {
    vec3 point = element(probe_slots, first_slot + id.z).xyz + texel_direction(id.xy) * abs(seen.z);
    first_node = float(node_index(lookup_cell(point, octahedral_decode(seen.xy), weights)));
  }
  imageStore(geometry, target, vec4(seen.xyz, first_node));
  imageStore(weights0, target, vec4(weights[0], weights[1], weights[2], weights[3]));
  imageStore(weights1, target, vec4(weights[4], weights[5], weights[6], weights[7]));
}
