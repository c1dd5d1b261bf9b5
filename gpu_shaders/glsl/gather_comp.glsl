/* Final gather: replaces the field's irradiance at a texel surface by `samples` paths of `bounces` real bounces, at whose ends the
 * field is read. The grid's interpolation error then reaches the probe only after that many diffuse reflections.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Reads layer first_layer + probe of geometry and albedo, adds to
 * `source`. Directions are cosine-weighted (Malley), direct light of lamps and small emitters is sampled at every vertex
 * (next-event estimation), emission that the field carries is found by the paths. The key of a number is (probe, texel, bounce, seed): any split of the work gives the same bytes.
 */

vec3 end_irradiance(vec3 point, vec3 normal)
{
  float weights[8];
  int first_node = node_index(lookup_cell(point, normal, weights));
  vec3 irradiance = field_irradiance(first_node, vec4(weights[0], weights[1], weights[2], weights[3]),
                                     vec4(weights[4], weights[5], weights[6], weights[7]), normal);
  return max(irradiance, vec3(0.0));
}

/* Radiance that arrives at a surface along one path, in units of that surface's albedo. */
vec3 trace_path(vec3 origin, vec3 normal, uvec3 key, int path)
{
  vec3 radiance = vec3(0.0);
  vec3 throughput = vec3(1.0);
  for (int bounce = 0; bounce < bounces; bounce++) {
    uvec3 bounce_key = uvec3(key.xy, key.z + uint(bounce + 1) * 0x85EBCA6Bu);
    vec3 direction = sample_cosine(normal, sample_r2(bounce_key, path));
    Hit hit = trace_closest(origin, direction);
    if (hit.triangle < 0) {
      ivec2 texel = direction_texel(direction);
      return radiance + throughput * element(world_texels, texel.y * FACE + texel.x).rgb;
    }
    Surface surface = resolve_surface(hit.triangle, hit.barycentric, origin, direction, 0.5);
    radiance += surface.emitter_density == 0.0 ? throughput * surface.emission : vec3(0.0);
    throughput *= surface.albedo;
    if (throughput == vec3(0.0)) {
      return radiance;
    }
    origin = step_off(surface.position, surface.normal, -direction, hit.distance);
    normal = surface.normal;
    uvec3 light_key = bounce_key + uvec3(0u, 0x1B873593u, 0u);
    vec3 irradiance = lamps_irradiance(surface.position, origin, normal, light_key, path);
#ifdef HAS_EMITTERS
    irradiance += emitter_irradiance(surface.position, origin, normal, light_key, path);
#endif
    if (bounce == bounces - 1) {
      irradiance += end_irradiance(surface.position, normal);
    }
    radiance += throughput * irradiance * 0.3183098861837907;
  }
  return radiance;
}

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 at = ivec3(id.xy, first_layer + id.z);
  vec4 seen = texelFetch(geometry, at, 0);
  vec3 reflectance = texelFetch(albedo, at, 0).rgb;
  if (seen.z >= NO_SURFACE || reflectance == vec3(0.0)) {
    return;
  }
  vec4 probe = element(probe_slots, first_slot + id.z);
  vec3 direction = texel_direction(id.xy);
  vec3 normal = octahedral_decode(seen.xy);
  vec3 origin = step_off(probe.xyz + direction * abs(seen.z), normal, -direction, abs(seen.z));
  uvec3 key = uvec3(uint(probe.w), uint(id.y * FACE + id.x), uint(seed));
  vec3 sum = vec3(0.0);
  for (int path = 0; path < samples; path++) {
    sum += trace_path(origin, normal, key, path);
  }
  imageStore(source, at, imageLoad(source, at) + vec4(reflectance * sum / float(samples), 0.0));
}
