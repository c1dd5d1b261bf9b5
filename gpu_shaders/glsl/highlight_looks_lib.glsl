/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Looks at lamps and sampled emitters, for highlights of a patch's light. */

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

struct Look {
  vec3 sum; /* of highlights by weight */
  float weight;
  float turn; /* of facets that mirror one way, seen face on, from one side of what is looked at to the other */
  bool is_sharp; /* a lobe was met that is narrow against that */
};

/* May the highlight at hand change much within what is looked at? */
bool is_sharp(vec3 normal, vec3 view, vec3 towards, float width, float turn)
{
  vec3 middle = normalize(view + towards);
  float height = max(dot(middle, normal), 1.0e-4);
  float turns = turn / max(dot(view, middle), 1.0e-3); /* a view at a slant turns them by more */
  return turns > SHARP * width && sqrt(max(1.0 - height * height, 0.0)) < NEAR_PEAK * (width + turns) * height;
}

void add_look(inout Look look, FaintGloss faint, Surface surface, vec3 view, vec3 towards, vec3 irradiance, float width)
{
  float weight = dot(abs(irradiance), LUMINANCE);
  if (weight > 0.0) {
    look.sum += weight * highlight(faint, surface, view, towards, width);
    look.weight += weight;
    look.is_sharp = look.is_sharp || is_sharp(surface.normal, view, towards, width, look.turn);
  }
}

/* Looks at the part of the light that is meant, as if nothing stood between: with HAS_EMITTERS a point on a sampled
 * emitter, else a place on each of the lamps first_light .. last_light. */
void look_at_part(inout Look look, FaintGloss faint, Surface surface, vec3 view, float width, uvec3 key, int index)
{
  coupling = surface.coupling;
#ifdef HAS_EMITTERS
  EmitterSample emitter = sample_emitter(sample_r3(key, index), surface.position);
  vec3 offset = emitter.point - surface.position;
  float squared = max(dot(offset, offset), 1.0e-20);
  vec3 towards = offset * inversesqrt(squared);
  float cosine = max(dot(towards, surface.normal), 0.0);
  vec3 irradiance = emitter.radiance * (cosine * abs(dot(towards, emitter.normal)) / (squared * emitter.density));
  add_look(look, faint, surface, view, towards, irradiance * coupled(cosine), width);
#else
  vec2 u = sample_r2(key, index);
  for (int light = first_light; light < last_light; light++) {
    LightSample light_sample = sample_light(light, surface.position, u);
    vec3 irradiance = unshadowed_irradiance(light, light_sample, surface.normal);
    add_look(look, faint, surface, view, light_sample.direction, irradiance, width);
  }
#endif
}

/* The mean highlight of so many looks at a patch that gets `unshadowed` luminance if nothing stands between: looks that
 * see much less than that show less of the light. */
vec3 mean_look(Look look, int looks, float unshadowed)
{
  float weight = max(look.weight, LEAST_SEEN * float(looks) * unshadowed);
  return weight > 0.0 ? look.sum / weight : vec3(0.0);
}
