/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lamps that texels on glossy surfaces mirror: looks at them from places all over what the texel shows.
 *
 * A look sees a point on every lamp, and every lamp that lies on a ray mirrored by one facet, each by its share
 * (gloss_light_lib). LOOKS_A_RAY looks share the rays of one of them: what is chosen by what it brings if nothing
 * stands between stands for all (Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", EGSR 2005).
 * Dispatch: one thread an entry of `glossy`, `count` from `first` on; groups of 64.
 * Writes into `carried` of each entry what lamps send, and in w which of the places that texel_reflections_comp sends
 * rays from something hides: bit by bit.
 * Reference: core/reference_gloss.py.
 */

/* Drivers that unroll its loops compile this for twice as long, and run it no faster. */
#pragma optionNV(unroll none)

/* What is seen of one lamp from a place in the texel. */
struct Seen {
  vec3 direction; /* of the place from the probe */
  float distance;
  vec3 radiance; /* that goes to the probe if nothing stands between */
  int light;
  LightSample towards; /* the lamp */
  vec3 origin;         /* of the ray to it */
};

/* Of what looks see: one, and what it stands for. */
struct Choice {
  Seen seen;
  float weight, total;
};

void consider(inout Choice choice, inout float number, Way way, vec3 radiance, int light, LightSample towards)
{
  float weight = abs(radiance.r) + abs(radiance.g) + abs(radiance.b);
  if (takes(weight, number, choice.total)) {
    choice.seen = Seen(way.direction, way.hit.distance, radiance, light, towards, beginning(way));
    choice.weight = weight;
  }
}

/* Of `looks` looks from `first_look` on. */
Choice one_look(GlossyEntry glossy_at, int first_look, int looks)
{
  Choice choice;
  choice.weight = 0.0;
  choice.total = 0.0;
  Gloss gloss = glossy_at.gloss;
  float number = sample_r3(glossy_at.place_key, first_look).z;
  for (int look = first_look; look < first_look + looks; look++) {
    vec2 place = sample_r3(glossy_at.place_key, look).xy;
    Way way = way_through(place, glossy_at.middle, glossy_at.origin, glossy_at.at.xy);
    uvec3 event = reflection_event(glossy_at.light_key, look, 0);
    Reflection reflection = reflect_at(gloss, way.surface, way.hit.triangle, -way.direction, event,
                                       sample_r2(glossy_at.light_key, look));
    for (int light = 0; light < light_count; light++) {
#ifdef HAS_LINKS
      if (!falls_on(group_of_light(light), lit_role)) {
        continue;
      }
#endif
      LightSample towards;
      vec3 radiance = lamp_in_gloss(
          light, gloss, way.surface, -way.direction, glossy_at.width, glossy_at.light_key, look, towards);
      consider(choice, number, way, radiance, light, towards);
      float distance;
      radiance = lamp_met(light, way.surface.position, reflection.direction, distance) * reflection.mirrored *
                 (1.0 - share_of_points_on(lamp_extent(light, way.surface.position), glossy_at.width));
      consider(choice, number, way, radiance, light, LightSample(reflection.direction, distance, vec3(0.0)));
    }
  }
  return choice;
}

void main()
{
  int entry = first + LINEAR_THREAD;
  if (entry >= first + count) {
    return;
  }
  GlossyEntry glossy_at = glossy_entry(entry);
#ifdef HAS_LINKS
  lit_role = role_of_triangle(glossy_at.middle.hit.triangle);
#endif
  int looks = light_count > 0 ? clamp(LOOKS_IN_ALL / light_count, LEAST_LOOKS, LOOKS) : 0;
  int turns = (looks + LOOKS_A_RAY - 1) / LOOKS_A_RAY;
  vec3 sum = vec3(0.0);
  int hidden = 0;
  for (int turn = -REFLECTIONS; turn < turns; turn++) { /* first the places that rays leave from, then looks */
    Choice choice;
    if (turn < 0) {
      Way way = ray_place(glossy_at, glossy_at.number * REFLECTIONS + turn + REFLECTIONS);
      choice.seen.direction = way.direction;
      choice.seen.distance = way.hit.distance;
      choice.weight = 1.0;
    }
    else {
      int look = turn * LOOKS_A_RAY;
      choice = one_look(glossy_at, glossy_at.number * looks + look, min(LOOKS_A_RAY, looks - look));
    }
    Seen seen = choice.seen;
    bool sees = choice.weight > 0.0 && !trace_any(glossy_at.origin, seen.direction, seen.distance * 0.999);
    if (turn < 0) {
      hidden |= sees ? 0 : 1 << (turn + REFLECTIONS);
    }
    else if (sees) {
      vec3 standing_for = seen.radiance * (choice.total / choice.weight);
      sum += brought_by(ray_to_light(seen.light, seen.towards, seen.origin, standing_for));
    }
  }
  imageStore(carried, element_position(entry), vec4(looks > 0 ? sum / float(looks) : vec3(0.0), float(hidden)));
}
