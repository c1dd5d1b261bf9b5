/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lamps and sampled emitters as glossy surfaces see them: met by mirrored rays, and by points on them, each to its
 * share.
 *
 * Reference: core/reference_gloss.py. A lamp is met where sample_plain_light would have put a sample.
 */

/* Steradians, roughly, by the lamp's size and the distance of its middle. */
float lamp_extent(int light, vec3 point)
{
  int kind = int(element(lights, 6 * light).w);
  float radius = element(lights, 6 * light + 1).w;
  if (kind == SUN) {
    return 6.283185307179586 * radius;
  }
  float area = 3.141592653589793 * radius * radius;
  if (kind >= RECTANGLE) {
    area = element(lights, 6 * light + 2).w * element(lights, 6 * light + 3).w *
           (kind == ELLIPSE ? 0.7853981633974483 : 1.0);
  }
  vec3 to_centre = element(lights, 6 * light).xyz - point;
  return area / max(dot(to_centre, to_centre), 1.0e-20);
}

/* Where a ray meets an area lamp, and the share of its radiance that its spread lets through there; 0 where it does not
 * meet it. The distance counts only where it does. */
float area_met(int light, vec3 to_centre, vec3 direction, vec3 back, vec2 spread, out float distance)
{
  distance = NO_HIT;
  float cosine = dot(direction, back);
  if (cosine <= 1.0e-6) {
    return 0.0;
  }
  distance = dot(to_centre, back) / cosine;
  vec4 right = element(lights, 6 * light + 2), up = element(lights, 6 * light + 3);
  vec3 place = direction * distance - to_centre;
  vec2 at = vec2(dot(place, right.xyz) / max(right.w, 1.0e-20), dot(place, up.xyz) / max(up.w, 1.0e-20));
  bool is_ellipse = int(element(lights, 6 * light).w) == ELLIPSE;
  if (distance <= 0.0 || (is_ellipse ? dot(at, at) >= 0.25 : max(abs(at.x), abs(at.y)) >= 0.5)) {
    return 0.0;
  }
  return spread.y > 0.0 ? max((spread.x - sqrt(max(1.0 - cosine * cosine, 0.0)) / cosine) * spread.y, 0.0) : 1.0;
}

/* The same for a ball, or the disk that faces the point, and the ball's radiance for an intensity of 1. */
float ball_met(vec3 to_centre, vec3 direction, float radius, bool is_soft, out float distance)
{
  distance = NO_HIT;
  float squared = dot(to_centre, to_centre), along = dot(to_centre, direction), size = radius * radius;
  if (along <= 0.0) {
    return 0.0;
  }
  if (is_soft || squared <= size) {
    distance = squared / along;
    return distance * distance - squared < size ? 0.3183098861837907 / size : 0.0;
  }
  float aside = squared - along * along;
  if (aside >= size) {
    return 0.0;
  }
  distance = along - sqrt(size - aside);
  return 0.3183098861837907 / size;
}

/* Radiance of a lamp that a ray meets, and how far off; suns are as far as nothing else. */
vec3 lamp_met(int light, vec3 point, vec3 direction, out float distance)
{
  vec4 position_kind = element(lights, 6 * light);
  vec4 color_radius = element(lights, 6 * light + 1);
  vec4 back = element(lights, 6 * light + 4);
  vec4 parameters = element(lights, 6 * light + 5);
  int kind = int(position_kind.w);
  float radius = color_radius.w;
  distance = NO_HIT;
  if (radius == 0.0 && kind < RECTANGLE) {
    return vec3(0.0);
  }
  if (kind == SUN) {
    bool meets = 1.0 - dot(direction, back.xyz) < radius;
    return meets ? color_radius.rgb / (3.141592653589793 * radius * (2.0 - radius)) : vec3(0.0);
  }
  vec3 to_centre = position_kind.xyz - point;
  float factor = kind >= RECTANGLE ? area_met(light, to_centre, direction, back.xyz, parameters.xy, distance) :
                                     ball_met(to_centre, direction, radius, parameters.z != 0.0, distance);
  if (factor == 0.0) {
    return vec3(0.0);
  }
  if (kind == SPOT) {
    factor *= spot_mask(light, direction, back.xyz, parameters);
  }
  vec3 radiance = color_radius.rgb * factor;
#ifdef HAS_PROFILES
  int profile = int(parameters.w);
  if (profile > 0) {
    radiance *= profile_factor(light, profile, direction, distance);
  }
#endif
  return radiance;
}

/* Radiance of all lamps along a ray that ends at `limit` and was mirrored in a lobe of this width, by the share that
 * rays answer for. */
vec3 lamps_met(vec3 point, vec3 direction, float limit, float width)
{
  vec3 sum = vec3(0.0);
  for (int light = 0; light < light_count; light++) {
#ifdef HAS_LINKS
    if (!falls_on(group_of_light(light), lit_role)) {
      continue;
    }
#endif
    float distance;
    vec3 radiance = lamp_met(light, point, direction, distance);
    if (distance < limit || limit == NO_HIT) {
      sum += radiance * (1.0 - share_of_points_on(lamp_extent(light, point), width));
    }
  }
  return sum;
}

/* Radiance that a glossy surface sends to `view` by light of a point on a lamp, if nothing stands between: sample
 * `index` of the sequences of `key`. */
vec3 lamp_in_gloss(int light, Gloss gloss, Surface surface, vec3 view, float width, uvec3 key, int index,
                   out LightSample light_sample)
{
  vec2 u = sample_r2(key + uvec3(0u, 0u, uint(light) * 0x9E3779B9u), index);
  light_sample = sample_light(light, surface.position, u);
  return gloss_lobe(gloss, surface, view, light_sample.direction, width) * light_sample.irradiance *
         share_of_points_on(lamp_extent(light, surface.position), width);
}

#ifdef HAS_EMITTERS
/* Steradians that each of CANDIDATES points on an emitter of the `group` stands for; 0 where points answer for all, as
 * light of the group passes surfaces, at which rays end. */
float emitter_extent(int group, float density, float distance, float emitter_cosine)
{
#ifdef HAS_LINKS
  if (has_passage(group)) {
    return 0.0;
  }
#endif
  return emitter_cosine / (float(CANDIDATES) * density * distance * distance);
}

/* The same by points on sampled emitters, of which one gets a ray: as ray_to_emitters. */
ShadowRay ray_to_emitters_in_gloss(Gloss gloss, Surface surface, vec3 origin, vec3 view, float width, uvec3 key,
                                   int index)
{
  vec3 best_radiance = vec3(0.0), best_point = vec3(0.0);
  int best_group = 0;
  float best_weight = 0.0, total = 0.0;
  float choice = sample_r3(key + uvec3(0x68E31DA4u, 0u, 0u), index).x;
  for (int i = 0; i < CANDIDATES; i++) {
    EmitterSample emitter = sample_emitter(sample_r3(key, index * CANDIDATES + i), surface.position);
    vec3 offset = emitter.point - surface.position;
    float squared = max(dot(offset, offset), 1.0e-20);
    float distance = sqrt(squared);
    vec3 direction = offset / distance;
    float cosine = abs(dot(direction, emitter.normal));
    vec3 radiance = emitter.radiance * gloss_lobe(gloss, surface, view, direction, width) *
                    (cosine / (squared * emitter.density) *
                     share_of_points_on(emitter_extent(emitter.group, emitter.density, distance, cosine), width));
    float weight = radiance.r + radiance.g + radiance.b;
    if (takes(weight, choice, total)) {
      best_radiance = radiance;
      best_point = emitter.point;
      best_group = emitter.group;
      best_weight = weight;
    }
  }
  if (best_weight == 0.0) {
    return NO_SHADOW_RAY;
  }
  return ray_to_emitter(best_point, origin, best_group, best_radiance * (total / (best_weight * float(CANDIDATES))));
}
#endif

/* Shadow rays that light of points on lamps and emitters takes: one to each lamp, one to all emitters. */
int gloss_light_rays()
{
#ifdef HAS_EMITTERS
  return light_count + 1;
#else
  return light_count;
#endif
}

/* One of them, with the radiance that the surface sends to `view`: sample `index` of the sequences of `key`. */
ShadowRay gloss_light_ray(int number, Gloss gloss, Surface surface, vec3 origin, vec3 view, float width, uvec3 key,
                          int index)
{
#ifdef HAS_EMITTERS
  if (number == light_count) {
    uvec3 emitter_key = key + uvec3(0u, 0u, 0x2545F491u);
    return ray_to_emitters_in_gloss(gloss, surface, origin, view, width, emitter_key, index);
  }
#endif
#ifdef HAS_LINKS
  if (!falls_on(group_of_light(number), lit_role)) {
    return NO_SHADOW_RAY;
  }
#endif
  LightSample light_sample;
  vec3 radiance = lamp_in_gloss(number, gloss, surface, view, width, key, index, light_sample);
  return ray_to_light(number, light_sample, origin, radiance);
}

/* Of the emission that a mirrored ray meets, the share that rays answer for. */
float emitter_share_of_rays(Surface surface, int triangle, vec3 direction, float distance, float width)
{
  int group = 0;
#ifdef HAS_LINKS
  group = group_of_triangle(triangle);
  if (!falls_on(group, lit_role)) {
    return 0.0;
  }
#endif
#ifdef HAS_EMITTERS
  if (surface.emitter_density > 0.0) {
    float cosine = abs(dot(direction, triangle_normal(triangle, -direction)));
    return 1.0 - share_of_points_on(emitter_extent(group, surface.emitter_density, distance, cosine), width);
  }
#endif
  return 1.0;
}
