/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Irradiance of light 0 at points by the place on it in `places`: shadow rays start at the points themselves. */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    vec3 point = element(points, i).xyz;
    LightSample light_sample = sample_light(0, point, element(places, i).xy);
    vec3 irradiance = unshadowed_irradiance(0, light_sample, element(normals, i).xyz);
    irradiance = brought_by(ray_to_light(0, light_sample, point, irradiance));
    imageStore(result, element_position(i), vec4(irradiance, 0.0));
  }
}
