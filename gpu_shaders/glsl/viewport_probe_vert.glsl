/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Probes as spheres, vertex stage: a square in front of each sphere, just large enough to hold its outline.
 *
 * Draw: 6 vertices, one instance per element of `spheres`: centre in the scene's frame, node or mark. Uses view_info as
 * viewport_surface_vert does.
 */

void main()
{
  vec4 sphere = element(spheres, gl_InstanceID);
  sphere_mark = sphere.w;
  sphere_centre = sphere.xyz;
  float radius = sphere_radius * (sphere.w < 0.0 ? 0.5 : 1.0);
  vec3 axis = view_info[3].xyz;
  float half_size = radius;
  bool outside = true;
  if (view_info[0].w == 0.0) {
    axis = sphere.xyz - view_info[0].xyz;
    float squared = dot(axis, axis);
    outside = squared > radius * radius * 1.02;
    /* the cone around the sphere, cut by the plane through its centre */
    half_size = radius * sqrt(squared / max(squared - radius * radius, 1.0e-20));
    axis *= inversesqrt(squared);
  }
  vec3 t = normalize(cross(axis, view_info[2].xyz));
  vec3 b = cross(t, axis);
  sphere_point = sphere.xyz + half_size * (corner.x * t + corner.y * b);
  vec4 point = vec4(sphere_point, 1.0);
  vec4 clip = vec4(
      dot(view_info[4], point), dot(view_info[5], point), dot(view_info[6], point), dot(view_info[7], point));
  gl_Position = outside ? clip : vec4(2.0, 2.0, 2.0, 1.0);
}
