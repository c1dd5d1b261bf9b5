/* Direct light of Blender's lights at a diffuse surface. Units and formulas are Cycles' (tests prove each);
 * reference: core/direct_light.py.
 *
 * lights, 6 elements each (scene_textures.py):
 *   position, kind | color, radius | right, size x | up, size y | back, casts shadow | parameters of the kind
 */

#ifndef FIRST_LIGHT
#define FIRST_LIGHT 0
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

LightSample sample_light(int light, vec3 point, vec2 u)
{
  vec4 position_kind = element(lights, 6 * light);
  vec4 color_radius = element(lights, 6 * light + 1);
  vec4 back_shadow = element(lights, 6 * light + 4);
  vec4 parameters = element(lights, 6 * light + 5);
  int kind = int(position_kind.w);
  float radius = color_radius.w;
  LightSample light_sample;
  vec3 t, b;

  if (kind == SUN) {
    /* a cone of radiance strength/(π sin²), so that a facing surface gets exactly the strength; radius is 1 − cos of half the
     * apparent angle */
    tangent_frame(back_shadow.xyz, t, b);
    float cosine = 1.0 - u.x * radius;
    float sine = sqrt(max(1.0 - cosine * cosine, 0.0)), phi = 6.283185307179586 * u.y;
    light_sample.direction = cosine * back_shadow.xyz + sine * (cos(phi) * t + sin(phi) * b);
    light_sample.distance = NO_HIT;
    light_sample.irradiance = color_radius.rgb * (2.0 / (2.0 - radius));
    return light_sample;
  }
  vec3 to_centre = position_kind.xyz - point;
  if (kind >= RECTANGLE) {
    vec4 right = element(lights, 6 * light + 2);
    vec4 up = element(lights, 6 * light + 3);
    vec2 place = kind == ELLIPSE ? 0.5 * sample_disk(u) : u - 0.5;
    vec3 to_light = to_centre + place.x * right.w * right.xyz + place.y * up.w * up.xyz;
    light_sample.distance = length(to_light);
    light_sample.direction = to_light / max(light_sample.distance, 1.0e-20);
    /* the light shines along −back: the surface must lie in front of it */
    float cosine = dot(light_sample.direction, back_shadow.xyz);
    float area = right.w * up.w * (kind == ELLIPSE ? 0.7853981633974483 : 1.0);
    float spread = 1.0;
    if (parameters.y > 0.0) {
      float tangent = sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 1.0e-6);
      spread = max((parameters.x - tangent) * parameters.y, 0.0);
    }
    light_sample.irradiance = color_radius.rgb *
                              (spread * max(cosine, 0.0) * area / max(light_sample.distance * light_sample.distance, 1.0e-20));
    return light_sample;
  }
  float squared = max(dot(to_centre, to_centre), 1.0e-20);
  float centre_distance = sqrt(squared);
  vec3 axis = to_centre / centre_distance;
  tangent_frame(axis, t, b);
  if (radius == 0.0) {
    light_sample.direction = axis;
    light_sample.distance = centre_distance;
    light_sample.irradiance = color_radius.rgb / squared;
  }
  else if (parameters.z != 0.0 || centre_distance <= radius) {
    /* soft falloff: a disk of radiance I/(πr²) that faces the surface */
    vec2 disk = radius * sample_disk(u);
    vec3 to_light = to_centre + disk.x * t + disk.y * b;
    float sample_squared = dot(to_light, to_light);
    light_sample.distance = sqrt(sample_squared);
    light_sample.direction = to_light / light_sample.distance;
    light_sample.irradiance = color_radius.rgb * centre_distance / (light_sample.distance * sample_squared);
  }
  else {
    /* a sphere of radiance I/(πr²), sampled over the cone that it fills */
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
  if (kind == SPOT) {
    light_sample.irradiance *= spot_mask(light, light_sample.direction, back_shadow.xyz, parameters);
  }
  return light_sample;
}

/* Irradiance of one light at a surface: one shadow ray to the place on the light that `u` picks. */
vec3 light_irradiance(int light, vec3 point, vec3 origin, vec3 normal, vec2 u)
{
  LightSample light_sample = sample_light(light, point, u);
  float cosine = dot(light_sample.direction, normal);
  if (cosine <= 0.0 || light_sample.irradiance == vec3(0.0)) {
    return vec3(0.0);
  }
  bool shadow = element(lights, 6 * light + 4).w != 0.0;
  if (shadow && trace_any(origin, light_sample.direction, light_sample.distance * 0.9999)) {
    return vec3(0.0);
  }
  return light_sample.irradiance * cosine;
}

/* Irradiance of all lamps: sample `index` of the sequences of `key`. */
vec3 lamps_irradiance(vec3 point, vec3 origin, vec3 normal, uvec3 key, int index)
{
  vec3 sum = vec3(0.0);
  for (int light = FIRST_LIGHT; light < light_count; light++) {
    vec2 u = sample_r2(key + uvec3(0u, 0u, uint(light) * 0x9E3779B9u), index);
    sum += light_irradiance(light, point, origin, normal, u);
  }
  return sum;
}

/* The same if nothing stood between. */
vec3 lamps_unshadowed(vec3 point, vec3 normal, uvec3 key, int index)
{
  vec3 sum = vec3(0.0);
  for (int light = FIRST_LIGHT; light < light_count; light++) {
    LightSample light_sample = sample_light(light, point, sample_r2(key + uvec3(0u, 0u, uint(light) * 0x9E3779B9u), index));
    sum += light_sample.irradiance * max(dot(light_sample.direction, normal), 0.0);
  }
  return sum;
}
