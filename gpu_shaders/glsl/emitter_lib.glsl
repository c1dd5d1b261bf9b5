/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Emissive triangles sampled as lights; which ones and why: core/emitters.py.
 *
 * emitters, 1 element each: triangle, upper end of its share of the total power, probability density per m²; and of as
 * many equal parts of the total power, the emitter in which the part of this number begins: a search has only few to
 * choose from (Chen and Asau, "On Generating Random Variates from an Empirical Distribution", AIIE Transactions 1974).
 * After them EMITTER_BOXES boxes (lower, upper corner) that together hold all of them.
 * The candidate that is traced is chosen by resampling (Talbot, Cline and Egbert, "Importance Resampling for Global
 * Illumination", EGSR 2005): CANDIDATES points by power, one of them by what it would send here if nothing stood
 * between.
 */

struct EmitterSample {
  vec3 point;
  vec3 normal;
  vec3 radiance;
  float density; /* per m² */
  int group;     /* of light linking; 0 without HAS_LINKS */
};

int find_emitter(float u)
{
  int part = min(int(u * float(emitter_count)), emitter_count - 1);
  int low = int(element(emitters, part).w);
  int high = part < emitter_count - 1 ? int(element(emitters, part + 1).w) : emitter_count - 1;
  while (low < high) {
    int middle = (low + high) / 2;
    if (element(emitters, middle).y <= u) {
      low = middle + 1;
    }
    else {
      high = middle;
    }
  }
  return low;
}

vec3 emitter_radiance(int triangle, vec2 barycentric)
{
  vec4 emission = element(materials, 3 * int(element(triangle_attributes, 5 * triangle).w) + 1);
  vec3 radiance = emission.rgb;
#ifdef HAS_IMAGES
  if (emission.w >= 0.0) {
    radiance *= sample_image(int(emission.w), triangle_uv(triangle, barycentric), 0.0).rgb;
  }
#endif
  return radiance;
}

/* Light from the point that `u` picks, as `viewer` sees it: none where that looks at a side that is not there. */
EmitterSample sample_emitter(vec3 u, vec3 viewer)
{
  EmitterSample chosen;
  vec4 emitter = element(emitters, find_emitter(u.z));
  int triangle = int(emitter.x);
  vec3 a = element(triangle_corners, 3 * triangle).xyz;
  vec4 corner1 = element(triangle_corners, 3 * triangle + 1);
  vec3 ab = corner1.xyz - a;
  vec3 ac = element(triangle_corners, 3 * triangle + 2).xyz - a;
  float root = sqrt(u.x);
  vec2 barycentric = vec2(root * (1.0 - u.y), root * u.y);
  chosen.point = a + ab * barycentric.x + ac * barycentric.y;
  chosen.normal = normalize(cross(ab, ac));
  chosen.density = emitter.z;
  chosen.radiance = emitter_radiance(triangle, barycentric);
  chosen.group = 0;
#ifdef HAS_UNSEEN
  if (is_missing_side(int(corner1.w), dot(chosen.normal, chosen.point - viewer))) {
    chosen.radiance = vec3(0.0);
  }
#endif
#ifdef HAS_LINKS
  chosen.group = group_of_triangle(triangle);
  chosen.radiance = falls_on(chosen.group, lit_role) ? chosen.radiance : vec3(0.0);
#endif
#ifdef HAS_ALPHA
  if (is_hole(triangle, barycentric)) {
    chosen.radiance = vec3(0.0);
  }
#endif
  return chosen;
}

/* Share of the light from an emitter `distance` away that points on emitters answer for; directions about the normal
 * answer for the rest. Balance heuristic (Veach and Guibas, SIGGRAPH 1995) of CANDIDATES points and one direction, so
 * no estimate is larger than π·L however near the emitter is; beyond emitter_reach, where directions would hardly find
 * it, points answer for all. So they do where light of the emitter's `group` passes surfaces, at which directions
 * end. */
float point_share(int group, float density, float distance, float surface_cosine, float emitter_cosine)
{
#ifdef HAS_LINKS
  if (has_passage(group)) {
    return 1.0;
  }
#endif
  if (distance >= emitter_reach) {
    return 1.0;
  }
  float point_density = float(CANDIDATES) * density * distance * distance;
  return point_density / (point_density + surface_cosine * emitter_cosine * 0.3183098861837907);
}

/* The ray to a point on an emitter that `brings` so much. From where it starts, which is off the surface: to an emitter
 * a few centimetres away it would be too long otherwise and meet the emitter itself. */
ShadowRay ray_to_emitter(vec3 point, vec3 origin, int group, vec3 brings)
{
  vec3 way = point - origin;
  float way_length = max(length(way), 1.0e-20);
  return ShadowRay(origin, way / way_length, way_length * 0.9999, group, brings);
}

/* Irradiance by points on emitters, the ray to one of them: sample `index` of the sequence of `key`. */
ShadowRay ray_to_emitters(vec3 point, vec3 origin, vec3 normal, uvec3 key, int index)
{
  vec3 best_irradiance = vec3(0.0), best_point = vec3(0.0);
  int best_group = 0;
  float best_weight = 0.0, total = 0.0;
  float choice = sample_r3(key + uvec3(0x68E31DA4u, 0u, 0u), index).x;
  for (int i = 0; i < CANDIDATES; i++) {
    EmitterSample emitter = sample_emitter(sample_r3(key, index * CANDIDATES + i), point);
    vec3 offset = emitter.point - point;
    float squared = max(dot(offset, offset), 1.0e-20);
    float distance = sqrt(squared);
    vec3 direction = offset / distance;
    float surface_cosine = max(dot(direction, normal), 0.0);
    float emitter_cosine = abs(dot(direction, emitter.normal));
    vec3 irradiance = emitter.radiance * (surface_cosine * emitter_cosine / (squared * emitter.density) *
                                          point_share(emitter.group, emitter.density, distance, surface_cosine,
                                                      emitter_cosine));
#ifdef HAS_COUPLING
    irradiance *= coupled(surface_cosine);
#endif
    float weight = irradiance.r + irradiance.g + irradiance.b;
    if (takes(weight, choice, total)) {
      best_irradiance = irradiance;
      best_point = emitter.point;
      best_group = emitter.group;
      best_weight = weight;
    }
  }
  if (best_weight == 0.0) {
    return NO_SHADOW_RAY;
  }
  return ray_to_emitter(best_point, origin, best_group, best_irradiance * (total / (best_weight * float(CANDIDATES))));
}

bool is_emitter_in_reach(vec3 point)
{
  for (int i = 0; i < EMITTER_BOXES; i++) {
    vec3 low = element(emitters, emitter_count + 2 * i).xyz, high = element(emitters, emitter_count + 2 * i + 1).xyz;
    vec3 apart = max(max(low - point, point - high), vec3(0.0));
    if (dot(apart, apart) <= emitter_reach * emitter_reach) {
      return true;
    }
  }
  return false;
}

/* Share of the emission of what a ray in a `direction` about the normal has hit that directions answer for. */
float direction_share(Hit hit, float density, vec3 direction, float surface_cosine)
{
  int group = 0;
#ifdef HAS_LINKS
  group = group_of_triangle(hit.triangle);
  if (!falls_on(group, lit_role)) {
    return 0.0;
  }
#endif
  vec3 a = element(triangle_corners, 3 * hit.triangle).xyz;
  vec3 across = cross(element(triangle_corners, 3 * hit.triangle + 1).xyz - a,
                      element(triangle_corners, 3 * hit.triangle + 2).xyz - a);
  return 1.0 - point_share(group, density, hit.distance, surface_cosine, abs(dot(direction, normalize(across))));
}

/* Irradiance by a direction about the normal that finds an emitter within emitter_reach: sample `index` of the sequence
 * of `key`. */
vec3 emitter_direction_irradiance(vec3 origin, vec3 normal, uvec3 key, int index)
{
  if (!is_emitter_in_reach(origin)) {
    return vec3(0.0);
  }
  vec3 direction = sample_cosine(normal, sample_r2(key + uvec3(0u, 0x3C6EF372u, 0u), index));
  Hit hit = trace_within(origin, direction, emitter_reach);
  float density = hit.triangle < 0 ? 0.0 : element(triangle_attributes, 5 * hit.triangle + 4).z;
  if (density == 0.0) {
    return vec3(0.0);
  }
  float surface_cosine = dot(direction, normal);
  vec3 arriving = direction_share(hit, density, direction, surface_cosine) *
                  passed_to(origin, direction, hit.distance);
#ifdef HAS_COUPLING
  arriving *= coupled(surface_cosine);
#endif
  return emitter_radiance(hit.triangle, hit.barycentric) * 3.141592653589793 * arriving;
}

/* Irradiance by one candidate if nothing stood between: candidate `index` of the sequence of `key`. */
vec3 emitter_unshadowed(vec3 point, vec3 normal, uvec3 key, int index)
{
  EmitterSample emitter = sample_emitter(sample_r3(key, index), point);
  vec3 offset = emitter.point - point;
  float squared = max(dot(offset, offset), 1.0e-20);
  float distance = sqrt(squared);
  vec3 direction = offset / distance;
  float surface_cosine = max(dot(direction, normal), 0.0);
  float emitter_cosine = abs(dot(direction, emitter.normal));
  return emitter.radiance * (surface_cosine * emitter_cosine / (squared * emitter.density) *
                             point_share(emitter.group, emitter.density, distance, surface_cosine, emitter_cosine));
}
