/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Probes as spheres, fragment stage: meets the ray with the sphere, so the outline and the depth are exact. */

void main()
{
  float radius = sphere_radius * (sphere_mark < 0.0 ? 0.5 : 1.0);
  vec3 direction = view_info[3].xyz;
  vec3 origin = sphere_point - 2.0 * radius * direction;
  if (view_info[0].w == 0.0) {
    origin = view_info[0].xyz;
    direction = normalize(sphere_point - origin);
  }
  vec3 to_centre = sphere_centre - origin;
  float along = dot(to_centre, direction);
  vec3 miss = to_centre - along * direction;
  float half_squared = radius * radius - dot(miss, miss);
  if (half_squared < 0.0) {
    discard;
  }
  vec3 hit = origin + direction * (along - sqrt(half_squared));
  vec4 point = vec4(hit, 1.0);
  gl_FragDepth = dot(view_info[6], point) / dot(view_info[7], point) * 0.5 + 0.5;
  radiance_sum = depth_only != 0 ? vec4(0.0) : vec4(shade_probe(int(sphere_mark), (hit - sphere_centre) / radius), 1.0);
}
