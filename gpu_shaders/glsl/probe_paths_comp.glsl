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

#ifdef HAS_COUPLING
/* Radiance times π beside the even one that `surface` sends to `view` of light by lamps and emitters, which it adds to
 * `irradiance`. */
vec3 highlights_of(int triangle, Surface surface, vec3 origin, vec3 normal, vec3 view, float blur, uvec3 lamp_key,
                   uvec3 emitter_key, inout vec3 irradiance)
{
  FaintGloss faint = faint_gloss_of(int(element(triangle_attributes, 5 * triangle).w));
  bool is_even = faint.gloss.share == vec3(0.0);
#ifdef HAS_SHEETS
  is_even = is_even || share_of_back(sheet_of_triangle(triangle)) != vec3(0.0);
#endif
  float width = max(faint.gloss.alpha, blur);
  vec3 sum = vec3(0.0), direction, arriving;
  int lamps_each = LAMPS_A_RAY;
  for (int first = FIRST_LIGHT; first < light_count; first += lamps_each) {
    int stop = min(first + lamps_each, light_count);
    arriving = lights_irradiance(first, stop, surface.position, origin, normal, lamp_key, 0, direction);
    irradiance += arriving;
    sum += is_even ? vec3(0.0) : arriving * highlight(faint, surface, view, direction, width);
  }
#ifdef HAS_EMITTERS
  arriving = emitter_points_irradiance(surface.position, origin, normal, emitter_key, 0, direction);
  irradiance += arriving;
  sum += is_even ? vec3(0.0) : arriving * highlight(faint, surface, view, direction, width);
  arriving = emitter_direction_irradiance(origin, normal, emitter_key, 0, direction);
  irradiance += arriving;
  sum += is_even ? vec3(0.0) : arriving * highlight(faint, surface, view, direction, width);
#endif
  return sum * 3.141592653589793;
}
#endif

void store(int entry, int part, vec3 direction, float behind, vec3 flux)
{
  ivec2 place = element_position(3 * entry + part);
  imageStore(directions, place, vec4(direction, behind));
  imageStore(flux_out, place, vec4(flux, 0.0));
}

/* From one point on the sampled emitters; in the direction `towards`. */
vec3 flux_of_emitters(vec3 start, uvec3 key, int number, out vec3 towards)
{
  vec3 flux = vec3(0.0);
  towards = vec3(0.0, 0.0, 1.0);
#ifdef HAS_EMITTERS
  EmitterSample emitter = sample_emitter(sample_r3(key + uvec3(0u, 1u, 0u), number), start);
  vec3 offset = emitter.point - start;
  float distance = max(length(offset), 1.0e-10);
  towards = offset / distance;
  float cosine = abs(dot(towards, emitter.normal));
  flux = emitter.radiance * (cosine / (emitter.density * distance * distance) *
                             share_of_points(emitter.density, distance, cosine));
  if (flux != vec3(0.0)) {
    flux *= light_along(start, towards, distance * 0.9999, 0);
  }
#endif
  return flux;
}

/* From one place on a sun of the world; in the direction `towards`. */
vec3 flux_of_suns(vec3 start, uvec3 key, int number, out vec3 towards)
{
  towards = vec3(0.0, 0.0, 1.0);
  int suns = light_count - first_sun;
  if (suns == 0) {
    return vec3(0.0);
  }
  LightSample light_sample = sample_light(
      first_sun + number % suns, start, sample_r2(key + uvec3(0u, 2u, 0u), number));
  towards = light_sample.direction;
  return light_sample.irradiance * float(suns) * light_along(start, towards, NO_HIT, 0);
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

/* Emission that a path counts where it meets `surface`: all that points on emitters do not answer for. */
vec3 emission_met(Hit hit, Surface surface, vec3 direction, int segment)
{
  bool falls = true;
#ifdef HAS_LINKS
  falls = falls_on(group_of_triangle(hit.triangle), lit_role);
  lit_role = role_of_triangle(hit.triangle);
#endif
  if (surface.emitter_density == 0.0 && falls) {
    return surface.emission;
  }
  if (segment == 0 && surface.emitter_density > 0.0) {
    return surface.emission * share_of_path(hit, surface.emitter_density, direction);
  }
  return vec3(0.0);
}

/* Irradiance by lamps and sampled emitters at `surface`, with what it sends to `view` in highlights. */
vec3 direct_light(int triangle, Surface surface, vec3 origin, vec3 normal, vec3 view, int segment, uvec3 segment_key)
{
  uvec3 lamp_key = segment_key + uvec3(1u, 0u, 0u), emitter_key = segment_key + uvec3(5u, 0u, 0u);
#ifdef HAS_COUPLING
  vec3 irradiance = vec3(0.0);
  float blur = segment == 0 ? 0.1 : PATCH_BLUR;
  vec3 highlighted = highlights_of(triangle, surface, origin, normal, view, blur, lamp_key, emitter_key, irradiance);
  irradiance += highlighted / max(surface.albedo, vec3(1.0e-9));
#else
  vec3 irradiance = lamps_irradiance(surface.position, origin, normal, lamp_key, 0);
#ifdef HAS_EMITTERS
  irradiance += emitter_irradiance(surface.position, origin, normal, emitter_key, 0);
#endif
#endif
  return irradiance;
}

/* Radiance along a path that leaves `origin` in `direction`; `behind` is 1 where it first meets a back face. */
vec3 follow_path(vec3 origin, vec3 direction, uvec3 key, out float behind)
{
  vec3 radiance = vec3(0.0), throughput = vec3(1.0);
  behind = 0.0;
  for (int segment = 0; segment <= bounces; segment++) {
    Hit hit = trace_closest(origin, direction);
    throughput *= passed_to(origin, direction, hit.distance);
    if (hit.triangle < 0) {
      ivec2 texel = direction_texel(direction);
      radiance += throughput * element(world_texels, texel.y * FACE + texel.x).rgb;
      break;
    }
    Surface surface = resolve_surface(hit.triangle, hit.barycentric, origin, direction, segment == 0 ? 0.05 : 0.5);
    radiance += throughput * emission_met(hit, surface, direction, segment);
    behind = segment == 0 && surface.back ? 1.0 : behind;
#ifdef HAS_GLOSS
    Way way = Way(direction, hit, surface, throughput, radiance);
    float blur = segment == 0 ? 0.03 : PATCH_BLUR;
    follow_reflections(way, key, 0, MOST_REFLECTIONS * segment, MOST_REFLECTIONS, blur, 0.1);
    direction = way.direction;
    hit = way.hit;
    surface = way.surface;
    throughput = way.throughput;
    radiance = way.brought;
#endif
    throughput *= surface.albedo;
    float survival = min(max(max(throughput.r, throughput.g), throughput.b), 1.0);
    if (survival == 0.0) {
      break;
    }
    uvec3 segment_key = pcg3d(key + uvec3(uint(segment), 0u, 0u));
    if (segment > 0) { /* Russian roulette (Arvo and Kirk, SIGGRAPH 1990) */
      if (random_pair(segment_key + uvec3(3u, 0u, 0u)).x >= survival) {
        break;
      }
      throughput /= survival;
    }
    vec3 normal = surface.normal;
    float side = 1.0;
#ifdef HAS_COUPLING
    coupling = surface.coupling;
#endif
#ifdef HAS_SHEETS /* which side light is looked for on is chosen by its share */
    vec3 through = share_of_back(sheet_of_triangle(hit.triangle));
    float chance = dot(through, vec3(1.0 / 3.0));
    bool crosses = random_pair(segment_key + uvec3(7u, 0u, 0u)).x < chance;
    side = crosses ? -1.0 : 1.0;
    throughput *= crosses ? through / chance : (1.0 - through) / (1.0 - chance);
    normal *= side;
#endif
    origin = step_off(surface.position, normal, -side * direction, hit.distance);
    vec3 irradiance = direct_light(hit.triangle, surface, origin, normal, -direction, segment, segment_key);
    radiance += throughput * irradiance * 0.3183098861837907;
    direction = sample_cosine(normal, random_pair(segment_key + uvec3(2u, 0u, 0u)));
#ifdef HAS_COUPLING
    throughput *= coupled(dot(normal, direction));
#endif
  }
  return radiance;
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

  vec3 towards;
  vec3 flux = flux_of_emitters(start, key, number, towards);
  store(entry, 1, towards, 0.0, flux);
  flux = flux_of_suns(start, key, number, towards);
  store(entry, 2, towards, 0.0, flux);

  vec2 u = sample_r2(key, number);
  float height = 1.0 - 2.0 * u.x, radius = sqrt(max(1.0 - height * height, 0.0));
  vec3 first = vec3(radius * cos(6.283185307179586 * u.y), radius * sin(6.283185307179586 * u.y), height);
  float behind;
  vec3 radiance = follow_path(start, first, pcg3d(key + uvec3(0u, uint(number), 0u)), behind);
  store(entry, 0, first, behind, radiance * SPHERE);
}
