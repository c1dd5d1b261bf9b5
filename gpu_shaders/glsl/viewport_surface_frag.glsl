/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The scene's triangles in a view, fragment stage: once for depth alone, then the nearest surface is shaded and added
 * to the sum.
 *
 * With several volumes the second pass runs once for each and shades what belongs to that one.
 * volume_boxes, 4 elements a volume: rows from the scene's frame to the box −1..1; half sizes, metres
 */

#ifdef VOLUMES
/* The volume that lights `point`: the first (smallest) that holds it, else the nearest. */
int owning_volume(vec3 point)
{
  int nearest = 0;
  float least = 3.0e38;
  for (int i = 0; i < VOLUMES; i++) {
    vec4 homogeneous = vec4(point, 1.0);
    vec3 place = vec3(dot(volume_boxes[4 * i], homogeneous), dot(volume_boxes[4 * i + 1], homogeneous),
                      dot(volume_boxes[4 * i + 2], homogeneous));
    vec3 outside = max(abs(place) - 1.0, vec3(0.0)) * volume_boxes[4 * i + 3].xyz;
    float squared = dot(outside, outside);
    if (squared < least) {
      least = squared;
      nearest = i;
    }
  }
  return nearest;
}
#endif

void main()
{
  int index = int(surface_triangle + 0.5);
  vec3 eye = view_info[0].xyz, forward = view_info[3].xyz;
  vec3 direction = forward;
  if (view_info[0].w == 0.0) {
    direction = normalize(surface_point - eye);
  }
  else {
    eye = surface_point - forward * dot(surface_point - eye, forward);
  }
#ifdef HAS_UNSEEN
  vec4 corner1 = element(triangle_corners, 3 * index + 1);
  int flags = int(corner1.w);
  if ((flags & (UNSEEN_BY_CAMERA | UNSEEN_FROM_BEHIND | UNSEEN_FROM_FRONT)) != 0) {
    vec3 a = element(triangle_corners, 3 * index).xyz;
    vec3 across = cross(corner1.xyz - a, element(triangle_corners, 3 * index + 2).xyz - a);
    if ((flags & UNSEEN_BY_CAMERA) != 0 || is_missing_side(flags, dot(across, direction))) {
      discard;
    }
  }
#endif
#ifdef HAS_ALPHA
  if ((int(element(triangle_corners, 3 * index + 1).w) & CLIPPED) != 0 && is_hole(index, surface_barycentric)) {
    discard;
  }
#endif
  radiance_sum = vec4(0.0);
  if (depth_only == 0) {
#ifdef VOLUMES
    if (owning_volume(surface_point) != volume) {
      discard;
    }
#endif
    Surface surface = resolve_surface(index, surface_barycentric, eye, direction, view_info[3].w);
    float distance = length(surface.position - eye);
    uvec3 key = pixel_key(ivec2(gl_FragCoord.xy));
    radiance_sum = vec4(shade_surface(surface, index, direction, distance, key, sample_index), 1.0);
  }
}
