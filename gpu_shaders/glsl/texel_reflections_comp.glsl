/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What texels on glossy surfaces see mirrored: REFLECTIONS rays each, which go on until they end on something diffuse,
 * and lamps.
 *
 * Rays leave, and lamps are looked at, from places spread over what the texel shows: mirrored things are smaller than a
 * texel.
 * Dispatch: x = columns, y = 6·FACE rows, z = probes from first_probe on; groups of 8×8×1. Texel: (probe · 6·FACE +
 * row) · FACE + column.
 * Writes for each ray `hits` (position, packed normal; −1 where nothing more comes), `hit_sheets` and `reflected`, by
 * which the light there counts; for each texel `carried`, what its rays brought along and lamps send; and into
 * `albedo`, what glossy texels send back diffusely.
 * Reference: core/reference_gloss.py.
 */

/* Radiance of lamps that a ray which leaves `way` along `direction` meets. */
vec3 lamps_mirrored(Way way, vec3 direction, float width)
{
  if (lamps_met(way.surface.position, direction, NO_HIT, width) == vec3(0.0)) {
    return vec3(0.0);
  }
  float limit = trace_closest(beginning(way), direction).distance;
  return lamps_met(way.surface.position, direction, limit, width);
}

bool is_hidden(Way way, vec3 origin)
{
  return trace_any(origin, way.direction, way.hit.distance * 0.999);
}

/* Radiance of lamps that the texel mirrors, in a lobe of this width: the mean of looks from places all over it. */
vec3 lamps_looked_at(Gloss gloss, Way middle, vec3 origin, ivec2 texel, float width, uvec3 place_key, uvec3 light_key)
{
  vec3 sum = vec3(0.0);
  int looks = light_count > 0 ? clamp(LOOKS_IN_ALL / light_count, LEAST_LOOKS, LOOKS) : 0;
  for (int i = 0; i < looks; i++) {
    int look = (texel.y * FACE + texel.x) * looks + i;
    Way way = way_through(sample_r3(place_key, look).xy, middle, origin, texel);
    vec3 light = lamps_in_gloss(gloss, way.surface, beginning(way), -way.direction, width, light_key, look);
    uvec3 event = reflection_event(light_key, look, 0);
    Reflection reflection = reflect_at(
        gloss, way.surface, middle.hit.triangle, -way.direction, event, sample_r2(light_key, look));
    light += reflection.mirrored * lamps_mirrored(way, reflection.direction, width);
    if (light != vec3(0.0) && !is_hidden(way, origin)) {
      sum += light / float(looks);
    }
  }
  return sum;
}

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, first_probe);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 at = ivec3(id.xy, first_layer + id.z);
  int texel = (id.z * 6 * FACE + id.y) * FACE + id.x;
  vec4 seen = texelFetch(geometry, at, 0);
  int triangle = int(seen.w);
  Gloss gloss = Gloss(vec3(0.0), 0.0, vec3(0.0), false);
  if (seen.z < NO_SURFACE) {
    gloss = gloss_of(triangle);
  }
  bool is_glossy = gloss.share != vec3(0.0);
  vec4 slot = element(probe_slots, first_slot + id.z);
  vec3 direction = texel_direction(id.xy);
  Way middle;
  uvec3 key = uvec3(uint(slot.w), 0x165667B1u, uint(seed));
  uvec3 place_key = key + uvec3(0u, 0x2C1B3C6Du, 0u), light_key = key + uvec3(0u, LIGHT_STREAM, 0u);
  int number = id.y * FACE + id.x;
  vec3 diffuse = vec3(0.0), brought = vec3(0.0);
  float width = 0.0;
  if (is_glossy) {
#ifdef HAS_LINKS
    lit_role = role_of_triangle(triangle);
#endif
    middle = met_in_middle(triangle, abs(seen.z), slot.xyz, direction);
    middle.surface.albedo *= passed_to(slot.xyz, direction, abs(seen.z) * 0.9999);
    /* so wide that places in the texel do not miss a lamp between them */
    width = max(gloss.alpha, TEXEL_BLUR * turn_over(middle, slot.xyz, id.xy));
    brought = lamps_looked_at(gloss, middle, slot.xyz, id.xy, width, place_key, light_key);
  }
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    vec4 end = vec4(0.0, 0.0, 0.0, -1.0);
    vec3 sent = vec3(0.0);
    int sheet = 0;
    bool on_surface = false;
    if (is_glossy) {
      int ray_number = number * REFLECTIONS + ray;
      uvec3 event = reflection_event(key, ray_number, 0);
      Way way = way_through(sample_r3(place_key + uvec3(0u, 0u, 1u), ray_number).xy, middle, slot.xyz, id.xy);
      if (is_hidden(way, slot.xyz)) {
        way = middle;
      }
      vec2 first = sample_r2(key, ray_number);
#ifdef HAS_LINKS
      lit_role = role_of_triangle(triangle);
#endif
      Reflection reflection = reflect_at(gloss, way.surface, triangle, -way.direction, event, first);
      diffuse += reflection.diffuse;
#ifdef HAS_EMITTERS
      uvec3 emitter_key = light_key + uvec3(0u, 0u, 0x2545F491u);
      way.brought = emitters_in_gloss(
          gloss, way.surface, beginning(way), -way.direction, width, emitter_key, ray_number);
#endif
      go_on(way, reflection, width, false, 2.0 / float(FACE));
      follow_reflections(way, key, ray_number, 1, MOST_REFLECTIONS - 1, PATCH_BLUR, 2.0 / float(FACE));
      brought += way.brought / float(REFLECTIONS);
      sent = way.throughput == vec3(0.0) ? vec3(0.0) : way.throughput * way.surface.albedo;
      if (sent != vec3(0.0)) {
#ifdef HAS_SHEETS
        sheet = sheet_of_triangle(way.hit.triangle);
        on_surface = share_of_back(sheet) != vec3(0.0);
#endif
        end.xyz = on_surface ? way.surface.position : pull_back(way.surface.position, way.direction, way.hit.distance);
        end.w = pack_normal(octahedral_encode(way.surface.normal));
      }
    }
    ivec2 place = element_position(texel * REFLECTIONS + ray);
    imageStore(hits, place, end);
    imageStore(reflected, place, vec4(sent, 0.0));
#ifdef HAS_SHEETS
    imageStore(hit_sheets, place, vec4(float(sheet)));
#endif
  }
  imageStore(carried, element_position(texel), vec4(brought, 0.0));
  if (is_glossy) {
    imageStore(albedo, at, vec4(diffuse / float(REFLECTIONS), imageLoad(albedo, at).w));
  }
}
