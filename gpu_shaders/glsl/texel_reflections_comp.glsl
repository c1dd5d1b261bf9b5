/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What texels on glossy surfaces see mirrored beside lamps: REFLECTIONS rays each, which go on until they end on
 * something diffuse.
 *
 * Rays leave from places spread over what the texel shows: mirrored things are smaller than a texel. Lamps there are
 * looked at by texel_lamps_comp, which says what places are hidden.
 * Dispatch: one thread an entry of `glossy`, `count` from `first` on; groups of 64.
 * Writes for each ray `hits` (position, packed normal; −1 where nothing more comes), `hit_sheets` and `reflected`, by
 * which the light there counts; adds to each entry's `carried` what its rays brought along; writes for its texel
 * `entries`, which entry it has, and into `albedo` what it sends back diffusely.
 * Reference: core/reference_gloss.py.
 */

/* Drivers that unroll its loops compile this for twice as long, and run it no faster. */
#pragma optionNV(unroll none)

const float SPREAD = 2.0 / float(FACE);

/* Follows a ray that leaves its place by `reflection` to where it ends on something diffuse. */
void follow(inout Way way, GlossyEntry glossy_at, Reflection reflection, int ray_number)
{
  Gloss gloss = glossy_at.gloss;
  float width = glossy_at.width;
  uvec3 light_key = glossy_at.light_key;
  int light_index = ray_number;
  for (int depth = 0; depth < MOST_REFLECTIONS; depth++) {
    vec3 origin = beginning(way), point = way.surface.position;
    for (int light = depth == 0 ? light_count : 0; light < gloss_light_rays(); light++) {
      ShadowRay ray = gloss_light_ray(
          light, gloss, way.surface, origin, -way.direction, width, light_key, light_index);
      way.brought += way.throughput * brought_by(ray);
    }
    way.throughput *= reflection.mirrored;
    way.direction = reflection.direction;
    bool has_met = advance(way, origin, SPREAD);
    if (depth > 0) {
      way.brought += way.throughput * lamps_met(point, way.direction, way.hit.distance, width);
    }
    if (!has_met) {
      way.brought += way.throughput * world_along(way.direction);
      way.throughput = vec3(0.0);
      return;
    }
    way.brought += way.throughput * emission_met_in_gloss(way, width);
    gloss = gloss_of(way.hit.triangle);
    uvec3 event = reflection_event(glossy_at.key, ray_number, depth + 1);
    if (depth == MOST_REFLECTIONS - 1 || way.throughput == vec3(0.0) || !is_mirrored(way, gloss, event, reflection)) {
      return;
    }
    width = max(gloss.alpha, PATCH_BLUR);
    light_key = event + uvec3(0u, LIGHT_STREAM, 0u);
    light_index = 0;
  }
}

/* Stores the light that a way counts of what it has ended on. */
void store_end(Way way, int ray)
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
  ivec2 ray_place = element_position(ray);
  imageStore(hits, ray_place, end);
  imageStore(reflected, ray_place, vec4(sent, 0.0));
#ifdef HAS_SHEETS
  imageStore(hit_sheets, ray_place, vec4(float(sheet)));
#endif
}

void main()
{
  int entry = first + LINEAR_THREAD;
  if (entry >= first + count) {
    return;
  }
  GlossyEntry glossy_at = glossy_entry(entry);
  int triangle = glossy_at.middle.hit.triangle;
  vec4 by_lamps = imageLoad(carried, element_position(entry));
  vec3 brought = by_lamps.rgb, diffuse = vec3(0.0);
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    int ray_number = glossy_at.number * REFLECTIONS + ray;
    bool hidden = (int(by_lamps.w) >> ray & 1) != 0;
    Way way = glossy_at.middle;
    if (!hidden) {
      way = ray_place(glossy_at, ray_number);
    }
#ifdef HAS_LINKS
    lit_role = role_of_triangle(triangle);
#endif
    uvec3 event = reflection_event(glossy_at.key, ray_number, 0);
    Reflection reflection = reflect_at(
        glossy_at.gloss, way.surface, triangle, -way.direction, event, sample_r2(glossy_at.key, ray_number));
    diffuse += reflection.diffuse / float(REFLECTIONS);
    follow(way, glossy_at, reflection, ray_number);
    brought += way.brought / float(REFLECTIONS);
    store_end(way, entry * REFLECTIONS + ray);
  }
  imageStore(carried, element_position(entry), vec4(brought, 0.0));
  imageStore(entries, element_position(glossy_at.texel), vec4(float(entry)));
  imageStore(albedo, glossy_at.at, vec4(diffuse, imageLoad(albedo, glossy_at.at).w));
}
