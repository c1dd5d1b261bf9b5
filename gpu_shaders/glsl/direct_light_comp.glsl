/* What a texel sends to its probe before any bounce: reflected direct light, and
 * emission as far as the field carries it.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Reads layer first_layer + probe of geometry, albedo and emission,
 * writes `source`.
 */

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
    vec3 direction = texel_direction(id.xy);
    vec3 normal = octahedral_decode(seen.xy);
    vec3 point = probe.xyz + direction * abs(seen.z);
    vec3 origin = step_off(point, normal, -direction, abs(seen.z));
    vec3 irradiance = vec3(0.0);
    for (int light = 0; light < light_count; light++) {
      uvec3 key = uvec3(uint(probe.w), uint(id.y * FACE + id.x), uint(light) * 0x9E3779B9u + uint(seed));
      irradiance += light_irradiance(light, point, origin, normal, key, samples);
    }
#ifdef HAS_EMITTERS
    uvec3 key = uvec3(uint(probe.w), uint(id.y * FACE + id.x), 0x2545F491u + uint(seed));
    irradiance += emitter_irradiance(point, origin, normal, key, samples);
#endif
    radiance += reflectance * irradiance;
  }
  imageStore(source, at, vec4(radiance, 0.0));
}
