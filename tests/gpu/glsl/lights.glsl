/* Irradiance of light 0 at points: origins of shadow rays are the points themselves. keys: node, texel, 16-bit halves of z. */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    vec3 point = element(points, i).xyz;
    uvec4 k = uvec4(element(keys, i));
    uvec3 key = uvec3(k.x, k.y, k.z << 16u | k.w);
    imageStore(result, element_position(i), vec4(light_irradiance(0, point, point, element(normals, i).xyz, key, samples), 0.0));
  }
}
