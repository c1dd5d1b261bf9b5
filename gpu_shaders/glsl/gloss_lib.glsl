/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Glossy surfaces: a mirrored part by GGX facets beside the diffuse one. Formulas, sources and reference:
 * core/gloss.py.
 *
 * gloss_rows, 2 elements a material: share of what is sent back that is mirrored, α | reflectance of facets that are
 * seen face on, 1 where the share is one of the light, whatever is sent back
 */

const float LEAST_FACET_COSINE = 1.0e-4;

struct Gloss {
  vec3 share;
  float alpha;
  vec3 facing;
  bool is_fixed;
};

struct Reflection {
  vec3 direction; /* where mirrored light comes from */
  vec3 mirrored;  /* what the facet mirrors */
  vec3 diffuse;   /* what the surface sends diffusely beside it */
};

#ifdef HAS_GLOSS
Gloss gloss_of(int triangle)
{
  int material = int(element(triangle_attributes, 5 * triangle).w);
  vec4 share = element(gloss_rows, 2 * material);
  vec4 facing = element(gloss_rows, 2 * material + 1);
  return Gloss(share.rgb, share.w, facing.rgb, facing.w != 0.0);
}
#endif

/* What facets mirror on average over all directions. */
vec3 mirrored_in_all(Gloss gloss, vec3 albedo)
{
  return gloss.is_fixed ? min(gloss.share, albedo) : albedo * gloss.share;
}

vec3 unit_numbers(uvec3 hash)
{
  return vec3(hash >> 8u) * (1.0 / 16777216.0);
}

uvec3 reflection_event(uvec3 key, int number, int depth)
{
  return pcg3d(key + uvec3(uint(number), REFLECTION_STREAM + uint(depth), 0u));
}

/* Growth of what facets of index 1.5 reflect (Fresnel), 0 for those seen face on. */
float dielectric_growth(float cosine)
{
  cosine = clamp(cosine, 0.0, 1.0);
  float bent = sqrt(1.25 + cosine * cosine);
  float across = (bent - cosine) / (bent + cosine);
  float turned = (cosine * (bent + cosine) - 1.0) / (cosine * (bent - cosine) + 1.0);
  return max((0.5 * across * across * (1.0 + turned * turned) - 0.04) / 0.96, 0.0);
}

float schlick_growth(float cosine)
{
  float grazing = clamp(1.0 - cosine, 0.0, 1.0);
  return grazing * grazing * grazing * grazing * grazing;
}

vec3 mirrored_by_facet(Gloss gloss, vec3 albedo, float cosine)
{
  bool is_dielectric = max(max(gloss.facing.r, gloss.facing.g), gloss.facing.b) < DIELECTRIC;
  float grazing = is_dielectric ? dielectric_growth(cosine) : schlick_growth(cosine);
  float seldom = 1.0 / (is_dielectric ? 18.5 + 89.7 * pow(gloss.alpha, 1.22) : 21.0 + 204.0 * pow(gloss.alpha, 1.55));
  vec3 shape = (gloss.facing + (1.0 - gloss.facing) * grazing) / (gloss.facing + (1.0 - gloss.facing) * seldom);
  return min(mirrored_in_all(gloss, albedo) * shape, vec3(1.0));
}

vec3 diffuse_beside(Gloss gloss, vec3 albedo, vec3 mirrored)
{
  vec3 whole = mirrored_in_all(gloss, albedo);
  vec3 share = mix(vec3(1.0), (1.0 - mirrored) / max(1.0 - whole, vec3(1.0e-3)), lessThan(whole, vec3(0.999)));
  return (albedo - whole) * share;
}

vec3 visible_facet(vec3 view, float alpha, vec2 u)
{
  vec3 width = vec3(alpha, alpha, 1.0);
  vec3 straight = normalize(view * width);
  float height = (1.0 - u.y) * (1.0 + straight.z) - straight.z;
  float sine = sqrt(clamp(1.0 - height * height, 0.0, 1.0)), angle = 6.283185307179586 * u.x;
  return normalize((vec3(sine * cos(angle), sine * sin(angle), height) + straight) * width);
}

/* Smith's Λ. */
float hidden_facets(float cosine, float alpha)
{
  float squared = cosine * cosine;
  return (sqrt(1.0 + alpha * alpha * max(1.0 - squared, 0.0) / squared) - 1.0) * 0.5;
}

vec3 triangle_normal(int triangle, vec3 view)
{
  vec3 a = element(triangle_corners, 3 * triangle).xyz;
  vec3 across = cross(element(triangle_corners, 3 * triangle + 1).xyz - a,
                      element(triangle_corners, 3 * triangle + 2).xyz - a);
  return normalize(dot(across, view) < 0.0 ? -across : across);
}

/* One facet of a surface seen from `view`: keys of `event`, `first` for the first attempt. */
Reflection reflect_at(Gloss gloss, Surface surface, int triangle, vec3 view, uvec3 event, vec2 first)
{
  vec3 t, b;
  tangent_frame(surface.normal, t, b);
  vec3 local = normalize(vec3(dot(view, t), dot(view, b), max(dot(view, surface.normal), LEAST_FACET_COSINE)));
  float seen = 1.0 + hidden_facets(local.z, gloss.alpha), cosine;
  vec3 way;
  for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
    vec3 numbers = unit_numbers(pcg3d(event + uvec3(uint(attempt + 1), 0u, 0u)));
    vec3 facet = visible_facet(local, gloss.alpha, attempt == 0 ? first : numbers.xy);
    cosine = dot(local, facet);
    way = 2.0 * cosine * facet - local;
    if (way.z > 0.0 && numbers.z * (seen + hidden_facets(max(way.z, LEAST_FACET_COSINE), gloss.alpha)) < seen) {
      break;
    }
  }
  Reflection reflection;
  reflection.direction = way.x * t + way.y * b + abs(way.z) * surface.normal;
  vec3 geometric = triangle_normal(triangle, view);
  reflection.direction -= 2.0 * min(dot(reflection.direction, geometric), 0.0) * geometric;
  reflection.direction = normalize(reflection.direction);
  reflection.mirrored = mirrored_by_facet(gloss, surface.albedo, cosine);
  reflection.diffuse = diffuse_beside(gloss, surface.albedo, reflection.mirrored);
  return reflection;
}

/* Width of a lobe of `alpha` that is no narrower than `blur`. */
float blurred(float alpha, float blur)
{
  return min(max(alpha, blur), 1.0); /* wider ones are none: a ball within a texel turns by more than that */
}

/* Radiance sent to the view per unit of radiance and solid angle from `towards`, cosine included, by a lobe of width
 * `alpha`. */
vec3 gloss_lobe(Gloss gloss, Surface surface, vec3 view, vec3 towards, float alpha)
{
  float arriving = dot(towards, surface.normal);
  if (arriving <= 0.0) {
    return vec3(0.0);
  }
  float squared = alpha * alpha;
  float leaving = max(dot(view, surface.normal), LEAST_FACET_COSINE);
  vec3 middle = normalize(view + towards);
  float height = dot(middle, surface.normal);
  float root = (squared - 1.0) * height * height + 1.0;
  float spread = squared / (3.141592653589793 * root * root);
  float masking = 1.0 + hidden_facets(leaving, alpha) + hidden_facets(max(arriving, LEAST_FACET_COSINE), alpha);
  float single = 1.0 - 0.62 * pow(alpha, 1.2);
  return mirrored_by_facet(gloss, surface.albedo, dot(view, middle)) * (spread / (masking * 4.0 * leaving * single));
}

/* Of the light of a lamp of so many steradians, or of an emitter of which each point stands for so many, what points
 * answer for where the lobe is of this `width` α. */
float share_of_points_on(float extent, float width)
{
  float lobe = 12.566370614359172 * width * width;
  return lobe / (lobe + extent);
}
