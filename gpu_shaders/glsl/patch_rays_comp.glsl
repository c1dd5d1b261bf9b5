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

#if SEGMENTS > 1
vec3 irradiance_at(vec3 point, vec3 origin, vec3 normal, uvec3 key, int index)
{
  vec3 irradiance = lamps_irradiance(point, origin, normal, key, index);
#ifdef HAS_EMITTERS
  irradiance += emitter_irradiance(point, origin, normal, key, index);
#endif
  return irradiance;
}

/* Where a ray that came along a direction goes on as a path. */
struct Bounce {
  vec3 irradiance; /* direct, of both sides of a sheet by their shares */
  vec3 origin, normal; /* of the side that the path leaves from */
  vec3 weight; /* of that side */
};

Bounce bounce_at(Surface surface, int sheet, vec3 direction, float distance, uvec3 key, int segment, int number)
{
  Bounce bounce;
#ifdef HAS_COUPLING
  coupling = surface.coupling;
#endif
  bounce.normal = surface.normal;
  bounce.origin = step_off(surface.position, surface.normal, -direction, distance);
  bounce.weight = vec3(1.0);
  uvec3 light_key = key + uvec3(0u, 0x1B873593u + uint(segment), 0u);
  bounce.irradiance = irradiance_at(surface.position, bounce.origin, surface.normal, light_key, number);
#ifdef HAS_SHEETS
  vec3 through = share_of_back(sheet);
  if (through != vec3(0.0)) {
    vec3 behind = step_off(surface.position, -surface.normal, direction, distance);
    uvec3 back_key = light_key + uvec3(0u, BACK_STREAM, 0u);
    bounce.irradiance = (1.0 - through) * bounce.irradiance +
                        through * irradiance_at(surface.position, behind, -surface.normal, back_key, number);
    bool crosses = (pcg3d(key + uvec3(uint(number), SIDE_STREAM + uint(segment), 0u)).x & 1u) != 0u;
    bounce.normal = crosses ? -surface.normal : surface.normal;
    bounce.origin = crosses ? behind : bounce.origin;
    bounce.weight = side_weight(through, crosses);
  }
#endif
  return bounce;
}
#endif

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= ray_count) {
    return;
  }
  int patch_index = (first_ray + entry) / rays_each;
  int number = (first_ray + entry) - patch_index * rays_each;
  vec4 at = element(patch_points, POINTS * patch_index + number * POINTS / rays_each % POINTS);
  vec3 normal = unpack_normal(at.w);
  vec3 brought = vec3(0.0), throughput = vec3(1.0);
  int sheet = 0;
  bool on_surface = false;
#ifdef HAS_SHEETS
  int own_sheet = int(element(sheet_numbers, patch_index).x);
  vec3 through = share_of_back(own_sheet);
  bool crosses = through != vec3(0.0) && (number & 1) != 0;
  normal = crosses ? -normal : normal;
  throughput = side_weight(through, crosses);
#endif
#ifdef HAS_LINKS
  lit_role = role_of_sheet(own_sheet);
#endif
#ifdef HAS_COUPLING
  coupling = element(couplings, 2 * patch_index);
#endif
  vec3 origin = leave_surface(at.xyz, normal);
  uvec3 key = uvec3(uint(first_key + patch_index), 0x85EBCA6Bu, uint(seed));
  vec4 end = vec4(0.0, 0.0, 0.0, -1.0);
  throughput = at.w < 0.0 ? vec3(0.0) : throughput; /* a texel that reflects nothing */
  for (int segment = 0; segment < SEGMENTS && throughput != vec3(0.0); segment++) {
    vec3 direction = sample_cosine(normal, sample_r2(key + uvec3(0u, uint(segment), 0u), number));
#ifdef HAS_COUPLING
    throughput *= coupled(dot(normal, direction));
#endif
    Hit hit = trace_closest(origin, direction);
    throughput *= passed_to(origin, direction, hit.distance);
    if (hit.triangle < 0) {
      ivec2 texel = direction_texel(direction);
      brought += throughput * element(world_texels, texel.y * FACE + texel.x).rgb;
      throughput = vec3(0.0);
      break;
    }
    Surface surface = resolve_surface(hit.triangle, hit.barycentric, origin, direction, 0.5);
    bool by_ray = surface.emitter_density == 0.0; /* else points on emitters answer for its emission */
#ifdef HAS_LINKS
    by_ray = by_ray && falls_on(group_of_triangle(hit.triangle), lit_role);
    lit_role = role_of_triangle(hit.triangle);
#endif
    brought += by_ray ? throughput * surface.emission : vec3(0.0);
#ifdef HAS_GLOSS
    Way way = Way(direction, hit, surface, throughput, brought);
    follow_reflections(way, key, number, MOST_REFLECTIONS * segment, MOST_REFLECTIONS, PATCH_BLUR, 0.5);
    direction = way.direction;
    hit = way.hit;
    surface = way.surface;
    throughput = way.throughput;
    brought = way.brought;
#endif
    throughput *= surface.albedo;
    if (throughput == vec3(0.0)) {
      break;
    }
#ifdef HAS_SHEETS
    sheet = sheet_of_triangle(hit.triangle);
    on_surface = share_of_back(sheet) != vec3(0.0);
#endif
    end.xyz = on_surface ? surface.position : pull_back(surface.position, direction, hit.distance);
    end.w = pack_normal(octahedral_encode(surface.normal));
#if SEGMENTS > 1
    if (segment < SEGMENTS - 1) {
      Bounce bounce = bounce_at(surface, sheet, direction, hit.distance, key, segment, number);
      brought += throughput * bounce.irradiance * 0.3183098861837907;
      throughput *= bounce.weight;
      normal = bounce.normal;
      origin = bounce.origin;
    }
#endif
  }
  imageStore(hits, element_position(entry), throughput == vec3(0.0) ? vec4(0.0, 0.0, 0.0, -1.0) : end);
  imageStore(carried, element_position(entry), vec4(brought, 0.0));
  imageStore(reflected, element_position(first_ray + entry), vec4(throughput, 0.0));
#ifdef HAS_SHEETS
  imageStore(hit_sheets, element_position(entry), vec4(float(sheet)));
#endif
}
