/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Direct light of Blender's lights at a diffuse surface. Units and formulas are Cycles' (tests prove each);
 * reference: core/direct_light.py.
 *
 * lights, 6 elements each (scene_textures.py):
 *   position, kind | color, radius | right, size x | up, size y | back, casts shadow | parameters of the kind, profile
 * With HAS_LINKS twice the light's group is added to whether it casts a shadow.
 * With HAS_PROFILES, after all lights their profiles (core/light_profiles.py), PROFILE_WIDTH × PROFILE_HEIGHT
 * directions and PROFILE_DISTANCES logarithms each; a light's profile is the first element of its own, 0 for none.
 */

#ifdef HAS_PROFILES
const int PROFILE_WIDTH = 64, PROFILE_HEIGHT = 32, PROFILE_DISTANCES = 5;
const float LEAST_PROFILE_DISTANCE = 0.25; /* metres; each is four times the one before */
#endif

#ifndef FIRST_LIGHT
#define FIRST_LIGHT 0
#endif
#ifndef LAMPS_A_RAY
#define LAMPS_A_RAY max((light_count + 15) / 16, 1) /* core/patches.py: lamps_a_ray */
#endif

const int POINT = 0, SPOT = 1, SUN = 2, RECTANGLE = 3, ELLIPSE = 4;

struct LightSample {
  vec3 direction; /* unit, towards the light */
  float distance;
  vec3 irradiance; /* per unit cosine at the surface: radiance × solid angle of the whole light */
};

/* The cone lives in the object's own frame: right.w and up.w undo its scale against that of the axis. */
float spot_mask(int light, vec3 towards, vec3 back, vec4 parameters)
{
  vec4 right = element(lights, 6 * light + 2);
  vec4 up = element(lights, 6 * light + 3);
  vec3 local = normalize(vec3(dot(towards, right.xyz) * right.w, dot(towards, up.xyz) * up.w, dot(towards, back)));
  float x = clamp((local.z - parameters.x) * parameters.y, 0.0, 1.0);
  return x * x * (3.0 - 2.0 * x);
}

#ifdef HAS_PROFILES
/* What a light's nodes make of the light that goes from it along `direction`, by which it is seen, over `distance`. */
vec3 profile_factor(int light, int profile, vec3 direction, float distance)
{
  vec3 local = -vec3(dot(direction, element(lights, 6 * light + 2).xyz),
                     dot(direction, element(lights, 6 * light + 3).xyz),
                     dot(direction, element(lights, 6 * light + 4).xyz));
  vec2 place = vec2(0.5 - atan(local.y, local.x) * 0.15915494309189535,
                    atan(local.z, length(local.xy)) * 0.3183098861837907 + 0.5);
  place = place * vec2(float(PROFILE_WIDTH), float(PROFILE_HEIGHT)) - 0.5;
  ivec2 low = ivec2(floor(place));
  vec2 blend = place - vec2(low);
  int left = (low.x + PROFILE_WIDTH) % PROFILE_WIDTH, right = (low.x + 1) % PROFILE_WIDTH;
  int bottom = profile + PROFILE_WIDTH * clamp(low.y, 0, PROFILE_HEIGHT - 1);
  int top = profile + PROFILE_WIDTH * clamp(low.y + 1, 0, PROFILE_HEIGHT - 1);
  vec3 factor = mix(mix(element(lights, bottom + left).rgb, element(lights, bottom + right).rgb, blend.x),
                    mix(element(lights, top + left).rgb, element(lights, top + right).rgb, blend.x), blend.y);
  float along = 0.5 * log2(max(distance, 1.0e-6) / LEAST_PROFILE_DISTANCE);
  int first = clamp(int(floor(along)), 0, PROFILE_DISTANCES - 2);
  int curve = profile + PROFILE_WIDTH * PROFILE_HEIGHT + first;
  return factor * exp2(mix(element(lights, curve).x, element(lights, curve + 1).x, along - float(first)));
}
#endif

/* Uniform in the cone of half the apparent angle. Its radiance is strength/(π sin²), so that a facing surface gets
 * exactly the strength; `radius` of a sun is 1 − cos of that half angle. */
LightSample sample_sun(int light, vec2 u)
{
  vec4 color_radius = element(lights, 6 * light + 1);
  vec3 back = element(lights, 6 * light + 4).xyz, t, b;
  tangent_frame(back, t, b);
  float cosine = 1.0 - u.x * color_radius.w;
  float sine = sqrt(max(1.0 - cosine * cosine, 0.0)), phi = 6.283185307179586 * u.y;
  LightSample light_sample;
  light_sample.direction = cosine * back + sine * (cos(phi) * t + sin(phi) * b);
  light_sample.distance = NO_HIT;
  light_sample.irradiance = color_radius.rgb * (2.0 / (2.0 - color_radius.w));
  return light_sample;
}

/* Uniform on the face, which shines along −back: the surface must lie in front of it. */
LightSample sample_area(int light, vec3 point, vec2 u)
{
  vec4 position_kind = element(lights, 6 * light);
  vec4 right = element(lights, 6 * light + 2);
  vec4 up = element(lights, 6 * light + 3);
  vec4 parameters = element(lights, 6 * light + 5);
  bool is_ellipse = int(position_kind.w) == ELLIPSE;
  vec2 place = is_ellipse ? 0.5 * sample_disk(u) : u - 0.5;
  vec3 to_light = position_kind.xyz - point + place.x * right.w * right.xyz + place.y * up.w * up.xyz;
  LightSample light_sample;
  light_sample.distance = length(to_light);
  light_sample.direction = to_light / max(light_sample.distance, 1.0e-20);
  float cosine = dot(light_sample.direction, element(lights, 6 * light + 4).xyz);
  float area = right.w * up.w * (is_ellipse ? 0.7853981633974483 : 1.0);
  float spread = 1.0;
  if (parameters.y > 0.0) {
    float tangent = sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 1.0e-6);
    spread = max((parameters.x - tangent) * parameters.y, 0.0);
  }
  light_sample.irradiance = element(lights, 6 * light + 1).rgb *
                            (spread * max(cosine, 0.0) * area /
                             max(light_sample.distance * light_sample.distance, 1.0e-20));
  return light_sample;
}

/* Falloff of points and spots of radiant intensity I: I/d² without a radius r. With one, a disk of radiance I/(πr²)
 * that faces the surface (soft falloff, and whatever lies within the radius), or else a sphere of that radiance,
 * sampled over the cone that it fills. */
LightSample sample_point(int light, vec3 point, vec2 u)
{
  vec4 color_radius = element(lights, 6 * light + 1);
  float radius = color_radius.w;
  bool is_soft = element(lights, 6 * light + 5).z != 0.0;
  vec3 to_centre = element(lights, 6 * light).xyz - point, t, b;
  float squared = max(dot(to_centre, to_centre), 1.0e-20);
  float centre_distance = sqrt(squared);
  vec3 axis = to_centre / centre_distance;
  tangent_frame(axis, t, b);
  LightSample light_sample;
  if (radius == 0.0) {
    light_sample.direction = axis;
    light_sample.distance = centre_distance;
    light_sample.irradiance = color_radius.rgb / squared;
  }
  else if (is_soft || centre_distance <= radius) {
    vec2 disk = radius * sample_disk(u);
    vec3 to_light = to_centre + disk.x * t + disk.y * b;
    float sample_squared = dot(to_light, to_light);
    light_sample.distance = sqrt(sample_squared);
    light_sample.direction = to_light / light_sample.distance;
    light_sample.irradiance = color_radius.rgb * centre_distance / (light_sample.distance * sample_squared);
  }
  else {
    float sine_squared = radius * radius / squared;
    float cos_max = sqrt(1.0 - sine_squared);
    float one_minus_cos = sine_squared / (1.0 + cos_max);
    float cosine = 1.0 - u.x * one_minus_cos;
    float sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    float phi = 6.283185307179586 * u.y;
    light_sample.direction = cosine * axis + sine * (cos(phi) * t + sin(phi) * b);
    light_sample.distance = centre_distance * cosine -
                            sqrt(max(radius * radius - squared * (1.0 - cosine * cosine), 0.0));
    light_sample.irradiance = color_radius.rgb * (2.0 * one_minus_cos / (radius * radius));
  }
  return light_sample;
}

/* What a light sends without its nodes. */
LightSample sample_plain_light(int light, vec3 point, vec2 u)
{
  int kind = int(element(lights, 6 * light).w);
  if (kind == SUN) {
    return sample_sun(light, u);
  }
  if (kind >= RECTANGLE) {
    return sample_area(light, point, u);
  }
  LightSample light_sample = sample_point(light, point, u);
  if (kind == SPOT) {
    light_sample.irradiance *= spot_mask(
        light, light_sample.direction, element(lights, 6 * light + 4).xyz, element(lights, 6 * light + 5));
  }
  return light_sample;
}

LightSample sample_light(int light, vec3 point, vec2 u)
{
  LightSample light_sample = sample_plain_light(light, point, u);
#ifdef HAS_PROFILES
  int profile = int(element(lights, 6 * light + 5).w);
  if (profile > 0) {
    light_sample.irradiance *= profile_factor(light, profile, light_sample.direction, light_sample.distance);
  }
#endif
  return light_sample;
}

#ifdef HAS_LINKS
int group_of_light(int light)
{
  return int(element(lights, 6 * light + 4).w) >> 1;
}
#endif

/* What a sample of a light sends to a surface if nothing stands between. */
vec3 unshadowed_irradiance(int light, LightSample light_sample, vec3 normal)
{
#ifdef HAS_LINKS
  if (!falls_on(group_of_light(light), lit_role)) {
    return vec3(0.0);
  }
#endif
  float cosine = max(dot(light_sample.direction, normal), 0.0);
#ifdef HAS_COUPLING
  return light_sample.irradiance * cosine * coupled(cosine);
#else
  return light_sample.irradiance * cosine;
#endif
}

/* The ray to a sample of a light that `brings` so much. */
ShadowRay ray_to_light(int light, LightSample light_sample, vec3 origin, vec3 brings)
{
  int group = 0;
#ifdef HAS_LINKS
  group = group_of_light(light);
#endif
  bool shadow = (int(element(lights, 6 * light + 4).w) & 1) != 0;
  return ShadowRay(origin, light_sample.direction, shadow ? light_sample.distance * 0.9999 : 0.0, group, brings);
}

/* For lights `first` .. `stop`: the place on each of them, and which one is chosen. */
vec3 numbers_of_lights(int first, int stop, uvec3 key, int index)
{
  uvec3 own_key = key + uvec3(0u, 0u, uint(first) * 0x9E3779B9u);
  return stop - first > 1 ? sample_r3(own_key, index) : vec3(sample_r2(own_key, index), 0.0);
}

/* Irradiance of lights `first` .. `stop`: the ray to one of them, chosen by what each sends if nothing stands between
 * (Talbot, Cline and Egbert, "Importance Resampling for Global Illumination", EGSR 2005, with every light a
 * candidate). */
ShadowRay ray_to_lights(int first, int stop, vec3 point, vec3 origin, vec3 normal, uvec3 key, int index)
{
  vec3 numbers = numbers_of_lights(first, stop, key, index);
  float choice = numbers.z;
  LightSample best_sample = LightSample(vec3(0.0), 0.0, vec3(0.0));
  vec3 best_irradiance = vec3(0.0);
  int best = -1;
  float best_weight = 0.0, total = 0.0;
  for (int light = first; light < stop; light++) {
    LightSample light_sample = sample_light(light, point, numbers.xy);
    vec3 irradiance = unshadowed_irradiance(light, light_sample, normal);
    float weight = abs(irradiance.r) + abs(irradiance.g) + abs(irradiance.b);
    if (takes(weight, choice, total)) {
      best_sample = light_sample;
      best_irradiance = irradiance;
      best_weight = weight;
      best = light;
    }
  }
  if (best < 0) {
    return NO_SHADOW_RAY;
  }
  return ray_to_light(best, best_sample, origin, best_irradiance * (total / best_weight));
}

/* Shadow rays that irradiance by all lamps takes: LAMPS_A_RAY neighbours share one. */
int lamp_rays()
{
  int lamps_each = LAMPS_A_RAY;
  return (light_count - FIRST_LIGHT + lamps_each - 1) / lamps_each;
}

/* One of them: sample `index` of the sequences of `key`. */
ShadowRay lamp_ray(int number, vec3 point, vec3 origin, vec3 normal, uvec3 key, int index)
{
  int lamps_each = LAMPS_A_RAY;
  int first = FIRST_LIGHT + number * lamps_each;
  return ray_to_lights(first, min(first + lamps_each, light_count), point, origin, normal, key, index);
}

/* Irradiance by all lamps if nothing stood between. */
vec3 lamps_unshadowed(vec3 point, vec3 normal, uvec3 key, int index)
{
  int lamps_each = LAMPS_A_RAY;
  vec3 sum = vec3(0.0);
  for (int first = FIRST_LIGHT; first < light_count; first += lamps_each) {
    int stop = min(first + lamps_each, light_count);
    vec2 u = numbers_of_lights(first, stop, key, index).xy;
    for (int light = first; light < stop; light++) {
      sum += unshadowed_irradiance(light, sample_light(light, point, u), normal);
    }
  }
  return sum;
}
