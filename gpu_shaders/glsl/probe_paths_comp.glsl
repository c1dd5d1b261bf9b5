/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Paths that leave probes in all directions and follow light to its end, whatever the bake made of it: an independent
 * estimate of what the probes should hold. No texel, patch or band is in it.
 *
 * Dispatch: one thread a path, paths_each for each series and probe, the probes of one series side by side; groups of
 * 64. Each writes three samples (direction, radiance over density) that together estimate the light from everywhere:
 * the path (density 1/4π), one point on the sampled emitters, one place on a sun of the world. Series are independent
 * of each other (SETS in core/path_check.py). The path's first direction is stratified over a probe's paths of a
 * series; everything after it is independent (one shifted sequence for several bounces would be correlated between
 * them). Directions carry in w whether the first surface is seen from behind.
 */

/* Drivers that unroll its loops compile this for twice as long, and run it no faster. */
#pragma optionNV(unroll none)

const float SPHERE = 12.566370614359172;

float share_of_points(float density, float distance, float cosine)
{
  float by_points = density * distance * distance;
  return by_points / (by_points + cosine / SPHERE);
}

vec2 random_pair(uvec3 key)
{
  return vec2(pcg3d(key).xy >> 8u) * (1.0 / 16777216.0);
}

void store(int entry, int part, vec3 direction, float behind, vec3 flux)
{
  ivec2 place = element_position(3 * entry + part);
  imageStore(directions, place, vec4(direction, behind));
  imageStore(flux_out, place, vec4(flux, 0.0));
}

/* From one point on the sampled emitters. */
ShadowRay ray_to_emitter_from(vec3 start, uvec3 key, int number)
{
#ifdef HAS_EMITTERS
  EmitterSample emitter = sample_emitter(sample_r3(key + uvec3(0u, 1u, 0u), number), start);
  vec3 offset = emitter.point - start;
  float distance = max(length(offset), 1.0e-10);
  float cosine = abs(dot(offset / distance, emitter.normal));
  vec3 flux = emitter.radiance * (cosine / (emitter.density * distance * distance) *
                                  share_of_points(emitter.density, distance, cosine));
  return ray_to_emitter(emitter.point, start, 0, flux);
#else
  return NO_SHADOW_RAY;
#endif
}

/* From one place on a sun of the world. */
ShadowRay ray_to_sun_from(vec3 start, uvec3 key, int number)
{
  int suns = light_count - first_sun;
  if (suns == 0) {
    return NO_SHADOW_RAY;
  }
  LightSample light_sample = sample_light(
      first_sun + number % suns, start, sample_r2(key + uvec3(0u, 2u, 0u), number));
  return ShadowRay(start, light_sample.direction, NO_HIT, 0, light_sample.irradiance * float(suns));
}

/* The part of a sampled emitter's light that the path brings itself, as it leaves the probe; points on it bring the
 * rest. */
float share_of_path(Hit hit, float density, vec3 direction)
{
  vec3 a = element(triangle_corners, 3 * hit.triangle).xyz;
  vec3 across = cross(element(triangle_corners, 3 * hit.triangle + 1).xyz - a,
                      element(triangle_corners, 3 * hit.triangle + 2).xyz - a);
  return 1.0 - share_of_points(density, hit.distance, abs(dot(direction, normalize(across))));
}

/* Where a path has left the place where it was last. */
struct Start {
  vec3 origin;
  int segment;
  vec3 normal; /* of the side that it left from */
  vec3 beyond; /* by which highlights add to what emitters send that way */
#ifdef HAS_GLOSS
  int reflections; /* in a row; 0: it was sent evenly */
  vec3 point;
  float width; /* of the lobe that it left in */
#endif
};

/* Emission that a path counts where it meets a surface: all that points on emitters do not answer for. */
vec3 emission_met(Way way, Start start)
{
#ifdef HAS_GLOSS
  if (start.reflections > 0) {
    return emission_met_in_gloss(way, start.width);
  }
#endif
  float density = way.surface.emitter_density;
  vec3 share = vec3(density == 0.0 && start.segment <= bounces ? 1.0 : 0.0);
  if (density > 0.0 && start.segment == 0) {
    share = vec3(share_of_path(way.hit, density, way.direction));
  }
#ifdef HAS_EMITTERS
  if (density > 0.0 && start.segment > 0) {
    share = (1.0 + start.beyond) * direction_share(way.hit, density, way.direction, dot(start.normal, way.direction));
  }
#endif
#ifdef HAS_LINKS
  share = falls_on(group_of_triangle(way.hit.triangle), lit_role) ? share : vec3(0.0);
  lit_role = role_of_triangle(way.hit.triangle);
#endif
  return way.surface.emission * share;
}

/* To the next surface, or into the world; takes along what is sent from there. */
bool go_on(inout Way way, Start start)
{
  float spread = start.segment == 0 ? 0.05 : 0.5;
#ifdef HAS_GLOSS
  spread = start.reflections > 0 ? 0.1 : spread;
#endif
  bool has_met = advance(way, start.origin, spread);
#ifdef HAS_GLOSS
  if (start.reflections > 0) {
    way.brought += way.throughput * lamps_met(start.point, way.direction, way.hit.distance, start.width);
  }
#endif
  if (!has_met) {
    way.brought += start.segment <= bounces ? way.throughput * world_along(way.direction) : vec3(0.0);
    return false;
  }
  way.brought += way.throughput * emission_met(way, start);
  return start.segment <= bounces;
}

/* What becomes of a path at the surface that it has met. */
struct Turn {
  bool is_mirrored;
  uvec3 key;
  float side; /* whose light is looked for: −1 for the back of a sheet */
#ifdef HAS_GLOSS
  Gloss gloss;
  Reflection reflection;
  float width;
#endif
#ifdef HAS_COUPLING
  FaintGloss faint;
  float faint_width; /* of the lobe of its highlights; 0 where it has none */
#endif
};

/* Is it mirrored there? Else its throughput becomes that of what the surface sends diffusely, 0 where the path ends. */
Turn turn_at(inout Way way, Start start, uvec3 key)
{
  Turn turn;
  turn.side = 1.0;
  turn.is_mirrored = false;
#ifdef HAS_GLOSS
  uvec3 event = reflection_event(key, 0, MOST_REFLECTIONS * start.segment + start.reflections);
  turn.gloss = gloss_of(way.hit.triangle);
  turn.width = max(turn.gloss.alpha, start.segment == 0 ? 0.03 : PATCH_BLUR);
  turn.key = event + uvec3(0u, LIGHT_STREAM, 0u);
  turn.is_mirrored = start.reflections < MOST_REFLECTIONS && is_mirrored(way, turn.gloss, event, turn.reflection);
  if (turn.is_mirrored) {
    return turn;
  }
#endif
  turn.key = pcg3d(key + uvec3(uint(start.segment), 0u, 0u));
  way.throughput *= way.surface.albedo;
  if (start.segment > 0) { /* Russian roulette (Arvo and Kirk, SIGGRAPH 1990) */
    float survival = min(max(max(way.throughput.r, way.throughput.g), way.throughput.b), 1.0);
    bool survives = random_pair(turn.key + uvec3(3u, 0u, 0u)).x < survival;
    way.throughput = survives ? way.throughput / survival : vec3(0.0);
  }
#ifdef HAS_SHEETS /* which side light is looked for on is chosen by its share */
  vec3 through = share_of_back(sheet_of_triangle(way.hit.triangle));
  float chance = dot(through, vec3(1.0 / 3.0));
  bool crosses = random_pair(turn.key + uvec3(7u, 0u, 0u)).x < chance;
  turn.side = crosses ? -1.0 : 1.0;
  way.throughput *= crosses ? through / chance : (1.0 - through) / (1.0 - chance);
#endif
#ifdef HAS_COUPLING
  coupling = way.surface.coupling;
  turn.faint = faint_gloss_of(int(element(triangle_attributes, 5 * way.hit.triangle).w));
  bool is_even = turn.faint.gloss.share == vec3(0.0);
#ifdef HAS_SHEETS
  is_even = is_even || through != vec3(0.0);
#endif
  turn.faint_width = is_even ? 0.0 : max(turn.faint.gloss.alpha, start.segment == 0 ? 0.1 : PATCH_BLUR);
#endif
  return turn;
}

/* Where rays begin that leave the side of the surface that the path goes on from. */
vec3 origin_of(Way way, Turn turn)
{
  return step_off(way.surface.position, turn.side * way.surface.normal, -turn.side * way.direction, way.hit.distance);
}

/* By how much highlights add to what the surface sends evenly of light by lamps and emitters from `direction`. */
vec3 highlight_beside(Way way, Turn turn, vec3 direction)
{
#ifdef HAS_COUPLING
  if (turn.faint_width > 0.0) {
    return highlight(turn.faint, way.surface, -way.direction, direction, turn.faint_width) * 3.141592653589793 /
           max(way.surface.albedo, vec3(1.0e-9));
  }
#endif
  return vec3(0.0);
}

/* Shadow rays of the surface that was met, for the light that it sends back along the path. */
int shadow_rays(Turn turn)
{
#ifdef HAS_GLOSS
  return turn.is_mirrored ? gloss_light_rays() : light_rays();
#else
  return light_rays();
#endif
}

ShadowRay shadow_ray(int ray_number, Way way, Turn turn)
{
#ifdef HAS_GLOSS
  if (turn.is_mirrored) {
    return gloss_light_ray(
        ray_number, turn.gloss, way.surface, origin_of(way, turn), -way.direction, turn.width, turn.key, 0);
  }
#endif
  uvec3 lamp_key = turn.key + uvec3(1u, 0u, 0u), emitter_key = turn.key + uvec3(5u, 0u, 0u);
  ShadowRay ray = light_ray(ray_number, way.surface.position, origin_of(way, turn), turn.side * way.surface.normal,
                            lamp_key, emitter_key, 0);
  ray.brings *= (1.0 + highlight_beside(way, turn, ray.direction)) * 0.3183098861837907;
  return ray;
}

/* From the surface that was met: on to where it is mirrored, or evenly. */
void leave(inout Way way, inout Start start, Turn turn)
{
  start.origin = origin_of(way, turn);
#ifdef HAS_GLOSS
  if (turn.is_mirrored) {
    start.reflections++;
    start.point = way.surface.position;
    start.width = turn.width;
    way.direction = turn.reflection.direction;
    way.throughput *= turn.reflection.mirrored;
    return;
  }
  start.reflections = 0;
#endif
  start.segment++;
  start.normal = turn.side * way.surface.normal;
  vec3 direction = sample_cosine(start.normal, random_pair(turn.key + uvec3(2u, 0u, 0u)));
  start.beyond = highlight_beside(way, turn, direction);
  way.direction = direction;
#ifdef HAS_COUPLING
  way.throughput *= coupled(dot(start.normal, direction));
#endif
}

/* Radiance along a path that leaves `origin` in `direction`; `behind` is 1 where it first meets a back face. */
vec3 follow_path(vec3 origin, vec3 direction, uvec3 key, out float behind)
{
  Way way;
  way.direction = direction;
  way.throughput = vec3(1.0);
  way.brought = vec3(0.0);
  Start start;
  start.origin = origin;
  start.segment = 0;
#ifdef HAS_GLOSS
  start.reflections = 0;
#endif
  behind = 0.0;
  for (bool first = true; way.throughput != vec3(0.0) && go_on(way, start); first = false) {
    behind = first && way.surface.back ? 1.0 : behind;
    Turn turn = turn_at(way, start, key);
    int rays = way.throughput == vec3(0.0) ? 0 : shadow_rays(turn);
    for (int ray_number = 0; ray_number < rays; ray_number++) {
      way.brought += way.throughput * brought_by(shadow_ray(ray_number, way, turn));
    }
    leave(way, start, turn);
  }
  return way.brought;
}

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= path_count) {
    return;
  }
  int row = entry / paths_each;
  int number = first_number + entry - row * paths_each;
  int series = row / probe_count, probe = row - series * probe_count;
  uvec3 key = uvec3(uint(probe), 0x9E3779B1u, uint(seed) ^ (uint(series) * 0x85EBCA6Bu));
  vec3 start = element(probe_points, probe).xyz;

  for (int part = 1; part <= 2; part++) {
    ShadowRay ray = part == 1 ? ray_to_emitter_from(start, key, number) : ray_to_sun_from(start, key, number);
    store(entry, part, ray.direction, 0.0, brought_by(ray));
  }

  vec2 u = sample_r2(key, number);
  float height = 1.0 - 2.0 * u.x, radius = sqrt(max(1.0 - height * height, 0.0));
  vec3 first = vec3(radius * cos(6.283185307179586 * u.y), radius * sin(6.283185307179586 * u.y), height);
  float behind;
  vec3 radiance = follow_path(start, first, pcg3d(key + uvec3(0u, uint(number), 0u)), behind);
  store(entry, 0, first, behind, radiance * SPHERE);
}
