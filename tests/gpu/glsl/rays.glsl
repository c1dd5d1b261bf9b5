/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Two elements a ray: nearest hit (distance, triangle, barycentric); is anything nearer than the limit in
 * directions.w? */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    vec4 direction = element(directions, i);
    vec3 origin = element(origins, i).xyz;
    Hit hit = trace_closest(origin, direction.xyz);
    imageStore(result, element_position(2 * i), vec4(hit.distance, float(hit.triangle), hit.barycentric));
    imageStore(result, element_position(2 * i + 1), vec4(trace_any(origin, direction.xyz, direction.w) ? 1.0 : 0.0));
  }
}
