/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rays that leave patches: where they end, what part of the light there comes back, and what light they bring along.
 *
 * Dispatch: one thread a ray from first_ray on, rays_each a patch; groups of 64. Directions are cosine-weighted
 * (Malley), stratified over the patch; with SEGMENTS above 1 a ray goes on as a path, and direct light is sampled where
 * it bounces.
 * Writes for each ray, counted from first_ray but for `reflected`: hits (position, packed normal; −1 where nothing more
 * can come), `carried` (emission that points on emitters do not answer for, or the world, and direct light at the
 * bounces) and `reflected` (product of the albedos on the way).
 * With HAS_GLOSS each of these ways goes on where it is mirrored, until it meets something diffuse.
 * Of patches on sheets every second ray leaves from the back; `hit_sheets` are those that rays end on.
 */

/* Drivers that unroll its loops compile this for twice as long, and run it no faster. */
#pragma optionNV(unroll none)

/* How a ray has left the place where it was last. */
struct Start {
  vec3 origin;
  vec3 normal; /* of the side that it left from */
  int segment;
#ifdef HAS_GLOSS
  int reflections; /* in a row; 0: it was sent evenly */
  vec3 point;
  float width; /* of the lobe that it left in */
#endif
};

/* What becomes of a ray at the surface that it has met. */
struct Turn {
  bool is_mirrored;
  int sheet; /* 0 where it is mirrored */
  vec3 through; /* by which light of that sheet's back counts */
#ifdef HAS_GLOSS
  Gloss gloss;
  Reflection reflection;
  float width;
  uvec3 light_key;
#endif
};

/* Emission that the ray counts of what it has met: what points on emitters do not answer for. */
vec3 emission_met(Way way, Start start)
{
#ifdef HAS_GLOSS
  if (start.reflections > 0) {
    return emission_met_in_gloss(way, start.width);
  }
#endif
  float density = way.surface.emitter_density;
  float share = density == 0.0 ? 1.0 : 0.0;
#if SEGMENTS > 1 && defined(HAS_EMITTERS)
  if (density > 0.0 && start.segment > 0) {
    share = direction_share(way.hit, density, way.direction, dot(start.normal, way.direction));
  }
#endif
#ifdef HAS_LINKS
  share = falls_on(group_of_triangle(way.hit.triangle), lit_role) ? share : 0.0;
  lit_role = role_of_triangle(way.hit.triangle);
#endif
  return way.surface.emission * share;
}

/* To the next surface, or into the world; takes along what is sent from there. */
bool go_on(inout Way way, Start start)
{
  bool has_met = advance(way, start.origin, 0.5);
#ifdef HAS_GLOSS
  if (start.reflections > 0) {
    way.brought += way.throughput * lamps_met(start.point, way.direction, way.hit.distance, start.width);
  }
#endif
  if (!has_met) {
    way.brought += way.throughput * world_along(way.direction);
    way.throughput = vec3(0.0);
    return false;
  }
  way.brought += way.throughput * emission_met(way, start);
  return true;
}

/* Is it mirrored there? Else its throughput becomes that of what the surface sends diffusely. */
Turn turn_at(inout Way way, Start start, uvec3 key, int number)
{
  Turn turn;
  turn.is_mirrored = false;
  turn.sheet = 0;
  turn.through = vec3(0.0);
#ifdef HAS_GLOSS
  uvec3 event = reflection_event(key, number, MOST_REFLECTIONS * start.segment + start.reflections);
  turn.gloss = gloss_of(way.hit.triangle);
  turn.width = max(turn.gloss.alpha, PATCH_BLUR);
  turn.light_key = event + uvec3(0u, LIGHT_STREAM, 0u);
  turn.is_mirrored = start.reflections < MOST_REFLECTIONS && is_mirrored(way, turn.gloss, event, turn.reflection);
  if (turn.is_mirrored) {
    return turn;
  }
#endif
#ifdef HAS_SHEETS
  turn.sheet = sheet_of_triangle(way.hit.triangle);
  turn.through = share_of_back(turn.sheet);
#endif
  way.throughput *= way.surface.albedo;
  return turn;
}

void leave_evenly(inout Way way, inout Start start, uvec3 key, int number)
{
  way.direction = sample_cosine(start.normal, sample_r2(key + uvec3(0u, uint(start.segment), 0u), number));
#ifdef HAS_COUPLING
  way.throughput *= coupled(dot(start.normal, way.direction));
#endif
#ifdef HAS_GLOSS
  start.reflections = 0;
#endif
}

#if SEGMENTS > 1 || defined(HAS_GLOSS)
/* Where rays begin that leave the front (1) or the back (−1) of the surface that was met. */
vec3 origin_on(float side, Way way)
{
  return step_off(way.surface.position, side * way.surface.normal, -side * way.direction, way.hit.distance);
}

/* Shadow rays of the surface that was met, for the light that it sends back along the way. */
int shadow_rays(Turn turn)
{
#ifdef HAS_GLOSS
  if (turn.is_mirrored) {
    return gloss_light_rays();
  }
#endif
  return turn.through == vec3(0.0) ? light_rays() : 2 * light_rays();
}

/* One of them; those of a sheet's back come after those of its front. */
ShadowRay shadow_ray(int ray_number, Way way, Start start, Turn turn, uvec3 key, int number)
{
#ifdef HAS_GLOSS
  if (turn.is_mirrored) {
    return gloss_light_ray(
        ray_number, turn.gloss, way.surface, origin_on(1.0, way), -way.direction, turn.width, turn.light_key, 0);
  }
#endif
#if SEGMENTS > 1
  bool back = ray_number >= light_rays();
  float side = back ? -1.0 : 1.0;
  uvec3 light_key = key + uvec3(0u, 0x1B873593u + uint(start.segment), 0u);
#ifdef HAS_SHEETS
  light_key.y += back ? BACK_STREAM : 0u;
#endif
  ShadowRay ray = light_ray(back ? ray_number - light_rays() : ray_number, way.surface.position, origin_on(side, way),
                            side * way.surface.normal, light_key, light_key, number);
  ray.brings *= (back ? turn.through : 1.0 - turn.through) * 0.3183098861837907;
  return ray;
#else
  return NO_SHADOW_RAY;
#endif
}

/* From the surface that was met: on to where it is mirrored, or evenly from one of the sides of a sheet. */
void leave(inout Way way, inout Start start, Turn turn, uvec3 key, int number)
{
#ifdef HAS_GLOSS
  if (turn.is_mirrored) {
    start = Start(origin_on(1.0, way), way.surface.normal, start.segment, start.reflections + 1, way.surface.position,
                  turn.width);
    way.direction = turn.reflection.direction;
    way.throughput *= turn.reflection.mirrored;
    return;
  }
#endif
  float side = 1.0;
#ifdef HAS_SHEETS
  bool crosses = turn.through != vec3(0.0) &&
                 (pcg3d(key + uvec3(uint(number), SIDE_STREAM + uint(start.segment), 0u)).x & 1u) != 0u;
  side = crosses ? -1.0 : 1.0;
  way.throughput *= side_weight(turn.through, crosses);
#endif
  start.origin = origin_on(side, way);
  start.normal = side * way.surface.normal;
  start.segment++;
  leave_evenly(way, start, key, number);
}
#endif

/* Follows a ray to where its light is that of a patch: position and packed normal there, and the sheet. */
vec4 follow(inout Way way, Start start, uvec3 key, int number, out int sheet)
{
  sheet = 0;
  while (way.throughput != vec3(0.0) && go_on(way, start)) {
    Turn turn = turn_at(way, start, key, number);
    if (way.throughput == vec3(0.0)) {
      break;
    }
    if (!turn.is_mirrored && start.segment == SEGMENTS - 1) {
      sheet = turn.sheet;
      vec3 end = turn.through != vec3(0.0) ? way.surface.position :
                                             pull_back(way.surface.position, way.direction, way.hit.distance);
      return vec4(end, pack_normal(octahedral_encode(way.surface.normal)));
    }
#if SEGMENTS > 1 || defined(HAS_GLOSS)
#ifdef HAS_COUPLING
    coupling = way.surface.coupling;
#endif
    int rays = shadow_rays(turn);
    for (int ray_number = 0; ray_number < rays; ray_number++) {
      way.brought += way.throughput * brought_by(shadow_ray(ray_number, way, start, turn, key, number));
    }
    leave(way, start, turn, key, number);
#endif
  }
  return vec4(0.0, 0.0, 0.0, -1.0);
}

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= ray_count) {
    return;
  }
  int patch_index = (first_ray + entry) / rays_each;
  int number = (first_ray + entry) - patch_index * rays_each;
  vec4 at = element(patch_points, POINTS * patch_index + number * POINTS / rays_each % POINTS);
  Start start;
  start.normal = unpack_normal(at.w);
  start.segment = 0;
  Way way;
  way.brought = vec3(0.0);
  way.throughput = vec3(1.0);
#ifdef HAS_SHEETS
  int own_sheet = int(element(sheet_numbers, patch_index).x);
  vec3 through = share_of_back(own_sheet);
  bool crosses = through != vec3(0.0) && (number & 1) != 0;
  start.normal = crosses ? -start.normal : start.normal;
  way.throughput = side_weight(through, crosses);
#endif
#ifdef HAS_LINKS
  lit_role = role_of_sheet(own_sheet);
#endif
#ifdef HAS_COUPLING
  coupling = element(couplings, 2 * patch_index);
#endif
  start.origin = leave_surface(at.xyz, start.normal);
  uvec3 key = uvec3(uint(first_key + patch_index), 0x85EBCA6Bu, uint(seed));
  leave_evenly(way, start, key, number);
  way.throughput = at.w < 0.0 ? vec3(0.0) : way.throughput; /* a texel that reflects nothing */
  int sheet;
  imageStore(hits, element_position(entry), follow(way, start, key, number, sheet));
  imageStore(carried, element_position(entry), vec4(way.brought, 0.0));
  imageStore(reflected, element_position(first_ray + entry), vec4(way.throughput, 0.0));
#ifdef HAS_SHEETS
  imageStore(hit_sheets, element_position(entry), vec4(float(sheet)));
#endif
}
