/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Capture by the layered pass, fragment stage: the same hit record that capture_trace_comp writes.
 *
 * The rasteriser says which triangle covers a texel; where the ray through the texel's centre meets it is computed
 * here. Rasterisers round corners to a 256th of a texel, and what they interpolate is off by as much. */

void main()
{
  int index = int(hit_triangle + 0.5);
  int layer = int(hit_layer + 0.5);
  int probe = layer / 6;
  vec3 direction = texel_direction(ivec2(gl_FragCoord.x, int(gl_FragCoord.y) + (layer - probe * 6) * FACE));
  vec3 origin = element(probe_slots, first_slot + probe).xyz;
  vec3 a = element(triangle_corners, 3 * index).xyz - origin;
  vec3 ab = element(triangle_corners, 3 * index + 1).xyz - origin - a;
  vec3 ac = element(triangle_corners, 3 * index + 2).xyz - origin - a;
  vec3 normal = cross(ab, ac);
  float slope = dot(normal, direction);
  float squared = dot(normal, normal);
  if (slope == 0.0 || squared == 0.0) {
    discard;
  }
  vec3 offset = direction * (dot(normal, a) / slope) - a;
  vec2 barycentric = vec2(dot(cross(offset, ac), normal), dot(cross(ab, offset), normal)) / squared;
  /* covered, but a little outside */
  vec3 weights = max(vec3(1.0 - barycentric.x - barycentric.y, barycentric), vec3(0.0));
  barycentric = weights.yz / (weights.x + weights.y + weights.z);
#ifdef HAS_UNSEEN
  int flags = int(element(triangle_corners, 3 * index + 1).w); /* see ray_lib */
  if ((flags & 4) != 0 || ((flags & 8) != 0 && slope > 0.0) || ((flags & 16) != 0 && slope < 0.0)) {
    discard;
  }
#endif
#ifdef HAS_ALPHA
  if ((int(element(triangle_corners, 3 * index + 1).w) & 1) != 0 && is_hole(index, barycentric)) {
    discard;
  }
#endif
  gl_FragDepth = length(a + ab * barycentric.x + ac * barycentric.y) / far_distance;
  hit = vec4(float(index), barycentric, 0.0);
}
