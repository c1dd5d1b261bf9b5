/* What a texel sends to its probe before any bounce: reflected direct light, and emission as far as the field carries it.
 *
 * Each of `samples` looks at another place of the texel's footprint, found on the plane of its surface without another ray, and at another
 * place of each light: shadow edges and bright spots are averaged over the texel instead of missed or hit by its centre.
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Reads layer first_layer + probe of geometry, albedo and emission,
 * writes `source`.
 */

/* Distance along `direction` of the plane through the texel's surface; the centre's where the plane is seen edge-on. */
float plane_distance(vec3 centre_direction, float distance, vec3 normal, vec3 direction)
{
  float range = distance * dot(centre_direction, normal) / dot(direction, normal);
  return range > 0.5 * distance && range < 2.0 * distance ? range : distance;
}

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 at = ivec3(id.xy, first_layer + id.z);
  vec4 seen = texelFetch(geometry, at, 0);
  vec4 emitted = texelFetch(emission, at, 0);
  vec3 radiance = emitted.a == 0.0 ? emitted.rgb : vec3(0.0);
  vec3 reflectance = texelFetch(albedo, at, 0).rgb * 0.3183098861837907;
  if (seen.z < NO_SURFACE && reflectance != vec3(0.0)) {
    vec4 probe = element(probe_slots, first_slot + id.z);
    vec3 normal = octahedral_decode(seen.xy);
    vec3 centre_direction = texel_direction(id.xy);
    uvec3 key = uvec3(uint(probe.w), uint(id.y * FACE + id.x), uint(seed));
    vec3 irradiance = vec3(0.0);
    for (int i = 0; i < samples; i++) {
      vec2 place = samples == 1 ? vec2(0.5) : sample_r2(key + uvec3(0u, 0u, 0x632BE5ABu), i);
      vec3 direction = texel_place_direction(id.xy, place);
      float range = plane_distance(centre_direction, abs(seen.z), normal, direction);
      vec3 point = probe.xyz + direction * range;
      vec3 origin = step_off(point, normal, -direction, range);
      irradiance += lamps_irradiance(point, origin, normal, key, i);
#ifdef HAS_EMITTERS
      irradiance += emitter_irradiance(point, origin, normal, key + uvec3(0u, 0u, 0x2545F491u), i);
#endif
    }
    radiance += reflectance * irradiance / float(samples);
  }
  imageStore(source, at, vec4(radiance, 0.0));
}
