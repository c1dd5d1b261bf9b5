/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What texels on glossy surfaces see mirrored: REFLECTIONS rays each, which go on until they end on something diffuse,
 * and lamps.
 *
 * Rays leave, and lamps are looked at, from places spread over what the texel shows: mirrored things are smaller than a
 * texel.
 * glossy: the texels, (probe · 6·FACE + row) · FACE + column, probes from first_layer on.
 * Dispatch: one thread an entry of these, `count` from `first` on; groups of 64.
 * Writes for each ray `hits` (position, packed normal; −1 where nothing more comes), `hit_sheets` and `reflected`, by
 * which the light there counts, and for each entry `carried`, what its rays brought along and lamps send; for its texel
 * `entries`, which entry it has, and into `albedo` what it sends back diffusely.
 * Reference: core/reference_gloss.py.
 */

/* Writes where a ray ended, as far as anything diffuse is sent from there. */
void store_end(Way way, ivec2 place)
{
  vec4 end = vec4(0.0, 0.0, 0.0, -1.0);
  vec3 sent = way.throughput == vec3(0.0) ? vec3(0.0) : way.throughput * way.surface.albedo;
  int sheet = 0;
  if (sent != vec3(0.0)) {
    bool on_surface = false;
#ifdef HAS_SHEETS
    sheet = sheet_of_triangle(way.hit.triangle);
    on_surface = share_of_back(sheet) != vec3(0.0);
#endif
    end.xyz = on_surface ? way.surface.position : pull_back(way.surface.position, way.direction, way.hit.distance);
    end.w = pack_normal(octahedral_encode(way.surface.normal));
  }
  imageStore(hits, place, end);
  imageStore(reflected, place, vec4(sent, 0.0));
#ifdef HAS_SHEETS
  imageStore(hit_sheets, place, vec4(float(sheet)));
#endif
}

void main()
{
  int entry = first + LINEAR_THREAD;
  if (entry >= first + count) {
    return;
  }
  int texel = int(element(glossy, entry).x);
  int number = texel % (6 * FACE * FACE), probe = texel / (6 * FACE * FACE);
  ivec2 place = ivec2(number % FACE, number / FACE);
  ivec3 at = ivec3(place, first_layer + probe);
  vec4 seen = texelFetch(geometry, at, 0), slot = element(probe_slots, first_slot + probe);
  int triangle = int(seen.w);
  Gloss gloss = gloss_of(triangle);
#ifdef HAS_LINKS
  lit_role = role_of_triangle(triangle);
#endif
  vec3 direction = texel_direction(place);
  Way middle = met_in_middle(triangle, abs(seen.z), slot.xyz, direction);
  middle.surface.albedo *= passed_to(slot.xyz, direction, abs(seen.z) * 0.9999);
  /* so wide that places in the texel do not miss a lamp between them */
  float width = blurred(gloss.alpha, TEXEL_BLUR * turn_over(middle, slot.xyz, place));
  uvec3 key = uvec3(uint(slot.w), 0x165667B1u, uint(seed));
  uvec3 place_key = key + uvec3(0u, 0x2C1B3C6Du, 0u), light_key = key + uvec3(0u, LIGHT_STREAM, 0u);
  vec3 brought = lamps_looked_at(gloss, middle, slot.xyz, place, width, place_key, light_key);
  vec3 diffuse = vec3(0.0);
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    int ray_number = number * REFLECTIONS + ray;
    uvec3 event = reflection_event(key, ray_number, 0);
    Way way = way_through(sample_r3(place_key + uvec3(0u, 0u, 1u), ray_number).xy, middle, slot.xyz, place);
    if (is_hidden(slot.xyz, way.direction, way.hit.distance)) {
      way = middle;
    }
#ifdef HAS_LINKS
    lit_role = role_of_triangle(triangle);
#endif
    Reflection reflection = reflect_at(
        gloss, way.surface, triangle, -way.direction, event, sample_r2(key, ray_number));
    diffuse += reflection.diffuse / float(REFLECTIONS);
#ifdef HAS_EMITTERS
    uvec3 emitter_key = light_key + uvec3(0u, 0u, 0x2545F491u);
    way.brought = emitters_in_gloss(
        gloss, way.surface, beginning(way), -way.direction, width, emitter_key, ray_number);
#endif
    go_on(way, reflection, width, false, 2.0 / float(FACE));
    follow_reflections(way, key, ray_number, 1, MOST_REFLECTIONS - 1, PATCH_BLUR, 2.0 / float(FACE));
    brought += way.brought / float(REFLECTIONS);
    store_end(way, element_position(entry * REFLECTIONS + ray));
  }
  imageStore(carried, element_position(entry), vec4(brought, 0.0));
  imageStore(entries, element_position(texel), vec4(float(entry)));
  imageStore(albedo, at, vec4(diffuse, imageLoad(albedo, at).w));
}
