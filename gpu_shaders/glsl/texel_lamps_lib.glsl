/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lamps that a glossy texel mirrors: looks at them from places all over it.
 *
 * A look sees a point on every lamp, and every lamp that lies on a ray mirrored by one facet, each by its share
 * (gloss_light_lib). LOOKS_A_RAY looks share the rays of one of them: what is chosen by what it brings if nothing
 * stands between stands for all (Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", EGSR 2005).
 * Reference: core/reference_gloss.py.
 */

/* Does anything stand before a place in the texel? */
bool is_hidden(vec3 origin, vec3 direction, float distance)
{
  return trace_any(origin, direction, distance * 0.999);
}

/* What one look sees of one lamp. */
struct Seen {
  vec3 radiance; /* that goes to the probe if nothing stands between */
  int light;
  vec3 seen_direction; /* of the place in the texel */
  float seen_distance;
  vec3 origin;         /* of the ray to the lamp */
  LightSample towards; /* the lamp */
};

/* Moves the choice on to what a look sees, by its weight. */
void consider(inout Seen chosen, inout float weight, inout float choice, inout float total, vec3 radiance, int light,
              Way way, LightSample towards)
{
  float own = abs(radiance.r) + abs(radiance.g) + abs(radiance.b);
  if (takes(own, choice, total)) {
    chosen = Seen(radiance, light, way.direction, way.hit.distance, beginning(way), towards);
    weight = own;
  }
}

/* One of `looks` looks from `first` on, and what it stands for: the sum of what they bring to the probe. */
vec3 lamps_by_one_look(Gloss gloss, Way middle, vec3 origin, ivec2 texel, float width, uvec3 place_key, uvec3 light_key,
                       int first, int looks)
{
  Seen chosen;
  float weight = 0.0, total = 0.0;
  float choice = sample_r3(place_key, first).z;
  for (int look = first; look < first + looks; look++) {
    Way way = way_through(sample_r3(place_key, look).xy, middle, origin, texel);
    uvec3 event = reflection_event(light_key, look, 0);
    Reflection reflection = reflect_at(
        gloss, way.surface, middle.hit.triangle, -way.direction, event, sample_r2(light_key, look));
    for (int light = 0; light < light_count; light++) {
#ifdef HAS_LINKS
      if (!falls_on(group_of_light(light), lit_role)) {
        continue;
      }
#endif
      LightSample towards;
      vec3 radiance = lamp_in_gloss(
          light, gloss, way.surface, -way.direction, width, light_key, look, towards);
      consider(chosen, weight, choice, total, radiance, light, way, towards);
      float distance;
      radiance = lamp_met(light, way.surface.position, reflection.direction, distance) * reflection.mirrored *
                 (1.0 - share_of_points_on(lamp_extent(light, way.surface.position), width));
      consider(chosen, weight, choice, total, radiance, light, way,
               LightSample(reflection.direction, distance, vec3(0.0)));
    }
  }
  if (weight == 0.0 || is_hidden(origin, chosen.seen_direction, chosen.seen_distance)) {
    return vec3(0.0);
  }
  return chosen.radiance * (total / weight) * light_arriving(chosen.light, chosen.towards, chosen.origin);
}

/* Radiance of lamps that the texel mirrors, in a lobe of this width. */
vec3 lamps_looked_at(Gloss gloss, Way middle, vec3 origin, ivec2 texel, float width, uvec3 place_key, uvec3 light_key)
{
  vec3 sum = vec3(0.0);
  int looks = light_count > 0 ? clamp(LOOKS_IN_ALL / light_count, LEAST_LOOKS, LOOKS) : 0;
  int first = (texel.y * FACE + texel.x) * looks;
  for (int look = 0; look < looks; look += LOOKS_A_RAY) {
    int together = min(LOOKS_A_RAY, looks - look);
    sum += lamps_by_one_look(
        gloss, middle, origin, texel, width, place_key, light_key, first + look, together);
  }
  return looks > 0 ? sum / float(looks) : vec3(0.0);
}
