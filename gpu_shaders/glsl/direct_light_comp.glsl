/* What a texel sends to its probe before any bounce: reflected direct light, and emission as far as the field carries it.
 *
 * Each of `samples` looks at another place of each light and, where the texel and its neighbours see one flat surface, at another place of
 * the texel's footprint, found on that plane without another ray: shadow edges and bright spots are averaged over the texel instead of
 * missed or hit by its centre. Over mouldings and edges the plane would lead behind the surface, so there the centre is kept.
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Reads layer first_layer + probe of geometry, albedo and emission,
 * writes `source`.
 */

/* Moves a view through a texel to `place` (0..1) of it: direction and distance of the plane of the centre's surface. Stays at the centre
 * where the plane is seen edge-on. */
void look_at_place(ivec2 texel, vec2 place, vec3 normal, inout vec3 direction, inout float distance)
{
  vec3 moved = texel_place_direction(texel, place);
  float range = distance * dot(direction, normal) / dot(moved, normal);
  if (range > 0.5 * distance && range < 2.0 * distance) {
    direction = moved;
    distance = range;
  }
}

/* Do the texel's neighbours on its face lie on the plane through `point`? */
bool lies_flat(ivec3 at, vec3 point, vec3 normal, float distance)
{
  for (int i = 0; i < 4; i++) {
    ivec3 neighbour = at + ivec3(i < 2 ? 2 * i - 1 : 0, i < 2 ? 0 : 2 * i - 5, 0);
    if (neighbour.x < 0 || neighbour.x >= FACE || neighbour.y < 0 || neighbour.y / FACE != at.y / FACE) {
      continue;
    }
    vec4 seen = texelFetch(geometry, neighbour, 0);
    if (seen.z >= NO_SURFACE || dot(octahedral_decode(seen.xy), normal) < 0.99) {
      return false;
    }
    if (abs(dot(texel_direction(neighbour.xy) * abs(seen.z) - point, normal)) > 0.01 * distance) {
      return false;
    }
  }
  return true;
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
    bool flat_footprint = samples > 1 && lies_flat(at, centre_direction * abs(seen.z), normal, abs(seen.z));
    vec3 irradiance = vec3(0.0);
    for (int i = 0; i < samples; i++) {
      vec3 direction = centre_direction;
      float range = abs(seen.z);
      if (flat_footprint) {
        look_at_place(id.xy, sample_r2(key + uvec3(0u, 0u, 0x632BE5ABu), i), normal, direction, range);
      }
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
