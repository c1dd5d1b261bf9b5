/* Irradiance of light 0 at points by the place on it in `places`: shadow rays start at the points themselves. */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    vec3 point = element(points, i).xyz;
    vec3 irradiance = light_irradiance(0, point, point, element(normals, i).xyz, element(places, i).xy);
    imageStore(result, element_position(i), vec4(irradiance, 0.0));
  }
}
