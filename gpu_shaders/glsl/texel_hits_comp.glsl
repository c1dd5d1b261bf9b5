/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Where texels meet surfaces that reflect, as one linear array: position and packed normal, −1 where there is nothing
 * to light. With HAS_SHEETS also on which sheet each lies; hits on sheets stay on the surface, because rays leave it on
 * both sides.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Element of a texel: (probe · 6·FACE + row) ·
 * FACE + column, for layer first_layer + probe.
 */

/* The point of a triangle nearest to `point`, which lies on its plane. Rasterised triangles reach a 256th of a texel
 * over their edges: a point there may lie behind the next wall. */
vec3 into_triangle(int triangle, vec3 point)
{
  vec3 a = element(triangle_corners, 3 * triangle).xyz;
  vec3 ab = element(triangle_corners, 3 * triangle + 1).xyz - a;
  vec3 ac = element(triangle_corners, 3 * triangle + 2).xyz - a;
  vec3 normal = cross(ab, ac);
  float squared = dot(normal, normal);
  if (squared == 0.0) {
    return point;
  }
  vec3 offset = point - a;
  vec3 weights;
  weights.y = dot(cross(offset, ac), normal) / squared;
  weights.z = dot(cross(ab, offset), normal) / squared;
  weights.x = 1.0 - weights.y - weights.z;
  if (min(weights.x, min(weights.y, weights.z)) >= 0.0) {
    return point;
  }
  weights = max(weights, vec3(0.0));
  weights /= weights.x + weights.y + weights.z;
  return a + ab * weights.y + ac * weights.z;
}

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 at = ivec3(id.xy, first_layer + id.z);
  vec4 seen = texelFetch(geometry, at, 0);
  vec4 hit = vec4(0.0, 0.0, 0.0, -1.0);
  int sheet = 0;
  bool on_surface = false;
  if (seen.z < NO_SURFACE && texelFetch(albedo, at, 0).rgb != vec3(0.0)) {
    vec3 direction = texel_direction(id.xy);
    vec3 point = element(probe_slots, first_slot + id.z).xyz + direction * abs(seen.z);
    hit.xyz = into_triangle(int(seen.w), point);
    hit.w = pack_normal(seen.xy);
#ifdef HAS_SHEETS
    sheet = sheet_of_triangle(int(seen.w));
    on_surface = share_of_back(sheet) != vec3(0.0);
#endif
    hit.xyz = on_surface ? hit.xyz : pull_back(hit.xyz, direction, abs(seen.z));
  }
  ivec2 place = element_position((id.z * 6 * FACE + id.y) * FACE + id.x);
  imageStore(hits, place, hit);
#ifdef HAS_SHEETS
  imageStore(hit_sheets, place, vec4(float(sheet)));
#endif
}
