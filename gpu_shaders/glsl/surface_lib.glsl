/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What a hit surface is made of: attributes of a triangle, its material, its images.
 *
 * Layouts are written by scene_textures.py:
 *   triangle_attributes, 5 elements a triangle: normals and (material, object, texture scale) in w; uv0 uv1;
 *     uv2, the density with which the triangle is sampled as an emitter (core/emitters.py), its number in the snapshot
 *   materials, 3 elements: diffuse albedo, base image | emission, emission image | alpha, threshold, alpha image, alpha
 *     from colour
 *   tints, 1 element a material: what its holes leave of light, image
 *   faint_gloss, 3 elements a material: see core/faint_gloss.py
 *   image_table, 1 element: first row in image_texels, width, height, extension
 *   image_texels: linear RGBA, mip levels of an image one after the other
 */

vec3 interpolate(vec3 a, vec3 b, vec3 c, vec2 barycentric)
{
  return a * (1.0 - barycentric.x - barycentric.y) + b * barycentric.x + c * barycentric.y;
}

#ifdef HAS_IMAGES
const int REPEAT = 0, EXTEND = 1, CLIP = 2, MIRROR = 3, ATLAS = 4;

int wrap_texel(int i, int size, int extension)
{
  if (extension == REPEAT) {
    return i - size * int(floor(float(i) / float(size)));
  }
  if (extension == MIRROR) {
    int period = i - 2 * size * int(floor(float(i) / float(2 * size)));
    return period < size ? period : 2 * size - 1 - period;
  }
  return clamp(i, 0, size - 1);
}

/* Bilinear sample; `footprint` is the width of the sampled area in uv units and picks the mip level. */
vec4 sample_image(int image, vec2 uv, float footprint)
{
  vec4 entry = element(image_table, image);
  ivec2 size = ivec2(entry.yz);
  int extension = int(entry.w);
  if (extension == CLIP && (min(uv.x, uv.y) < 0.0 || max(uv.x, uv.y) > 1.0)) {
    return vec4(0.0);
  }
  int start = int(entry.x) * 4096;
  int level = int(clamp(log2(max(footprint * float(max(size.x, size.y)), 1.0)) + 0.5, 0.0, 16.0));
  level = extension == ATLAS ? 0 : level; /* neighbours there are neighbours nowhere else */
  for (int i = 0; i < level && max(size.x, size.y) > 1; i++) {
    start += size.x * size.y;
    size = max(size / 2, ivec2(1));
  }
  vec2 position = uv * vec2(size) - 0.5;
  ivec2 corner = ivec2(floor(position));
  vec2 blend = position - vec2(corner);
  ivec2 low = ivec2(wrap_texel(corner.x, size.x, extension), wrap_texel(corner.y, size.y, extension));
  ivec2 high = ivec2(wrap_texel(corner.x + 1, size.x, extension), wrap_texel(corner.y + 1, size.y, extension));
  vec4 bottom = mix(element(image_texels, start + low.y * size.x + low.x),
                    element(image_texels, start + low.y * size.x + high.x), blend.x);
  vec4 top = mix(element(image_texels, start + high.y * size.x + low.x),
                 element(image_texels, start + high.y * size.x + high.x), blend.x);
  return mix(bottom, top, blend.y);
}

vec2 triangle_uv(int triangle, vec2 barycentric)
{
  vec4 uv01 = element(triangle_attributes, 5 * triangle + 3);
  vec4 uv2 = element(triangle_attributes, 5 * triangle + 4);
  return uv01.xy * (1.0 - barycentric.x - barycentric.y) + uv01.zw * barycentric.x + uv2.xy * barycentric.y;
}
#endif

#ifdef HAS_ALPHA
/* Threshold of partial transparency: core/dithering.py. */
float dither_threshold(int triangle, vec2 barycentric)
{
  uvec2 cell = uvec2(clamp(barycentric, 0.0, 1.0) * 256.0);
  uint mixed = uint(element(triangle_attributes, 5 * triangle + 4).w) * 0x9E3779B1u ^ cell.x * 0x85EBCA6Bu ^
               cell.y * 0xC2B2AE35u;
  mixed = (mixed ^ (mixed >> 16u)) * 0x7FEB352Du;
  mixed = (mixed ^ (mixed >> 15u)) * 0x846CA68Bu;
  mixed ^= mixed >> 16u;
  return (float(mixed >> 8u) + 0.5) / 16777216.0;
}

/* Is the material clipped away here? Sampled at full resolution: a mip would thin out leaves. */
bool is_hole(int triangle, vec2 barycentric)
{
  int material = int(element(triangle_attributes, 5 * triangle).w);
  vec4 clip = element(materials, 3 * material + 2);
  float alpha = clip.x;
#ifdef HAS_IMAGES
  if (clip.z >= 0.0) {
    vec4 texel = sample_image(int(clip.z), triangle_uv(triangle, barycentric), 0.0);
    alpha *= clip.w != 0.0 ? dot(texel.rgb, vec3(1.0 / 3.0)) : texel.a;
  }
#endif
  return alpha < (clip.y > 1.0 ? dither_threshold(triangle, barycentric) : clip.y);
}
#endif

#ifdef HAS_TINT
/* What the hole of a triangle leaves of light that passes it. */
vec3 hole_tint(int triangle, vec2 barycentric)
{
  vec4 tint = element(tints, int(element(triangle_attributes, 5 * triangle).w));
#ifdef HAS_IMAGES
  if (tint.w >= 0.0) {
    tint.rgb *= sample_image(int(tint.w), triangle_uv(triangle, barycentric), 0.0).rgb;
  }
#endif
  return tint.rgb;
}
#endif

struct Surface {
  vec3 position;
  vec3 normal; /* shading normal, on the viewer's side */
  bool back;   /* seen from behind */
  int object;
  vec3 albedo; /* towards the viewer */
  vec3 emission;
  float emitter_density; /* per m²; 0 where rays find the emission by themselves */
#ifdef HAS_FAINT_GLOSS
  vec4 coupling; /* see coupling_lib */
  vec3 mean_albedo; /* over all views */
#endif
};

#ifdef HAS_FAINT_GLOSS
/* What a surface with gloss that is not followed sends to a view at `cosine`, and how it takes light. */
void send_faint_gloss(inout Surface surface, int material, float cosine)
{
  surface.coupling = vec4(0.0, 0.0, 0.0, 1.0);
  surface.mean_albedo = surface.albedo;
  vec4 share = element(faint_gloss, 3 * material);
  if (share.rgb == vec3(0.0)) {
    return;
  }
  vec4 slope = element(faint_gloss, 3 * material + 1);
  vec3 whole = slope.w != 0.0 ? min(share.rgb, surface.albedo) : surface.albedo * share.rgb;
  float grazing = pow(clamp(1.0 - cosine, 0.0, 1.0), share.w) - 2.0 / ((share.w + 1.0) * (share.w + 2.0));
  vec3 mirrored = min(whole * (1.0 + slope.rgb * grazing), vec3(1.0));
  surface.coupling = vec4(slope.rgb * whole / max(surface.albedo, vec3(1.0e-9)), share.w);
  surface.albedo = mirrored + (surface.albedo - whole) * (1.0 - mirrored) / max(1.0 - whole, vec3(1.0e-3));
}
#endif

/* Where a ray meets a triangle's plane, near the `interpolated` hit. Interpolation is off by the rounding of the
 * corners, centimetres on a ground plane of kilometres; the plane is as exact as its nearest corner, and exact where it
 * is parallel to two axes. */
vec3 meet_plane(vec3 a, vec3 b, vec3 c, vec3 geometric, vec3 interpolated, vec3 origin, vec3 direction)
{
  vec3 to_a = a - origin, to_b = b - origin, to_c = c - origin;
  vec3 nearest = dot(to_b, to_b) < dot(to_a, to_a) ? to_b : to_a;
  nearest = dot(to_c, to_c) < dot(nearest, nearest) ? to_c : nearest;
  float slope = dot(geometric, direction);
  float guess = dot(interpolated - origin, direction);
  float distance = slope != 0.0 ? dot(geometric, nearest) / slope : guess;
  /* a sliver's normal is mostly rounding */
  return abs(distance - guess) < 0.01 * guess ? origin + direction * distance : interpolated;
}

/* Weights of corners 1 and 2 at a `point` of a triangle. */
vec2 barycentric_of(int triangle, vec3 point)
{
  vec3 a = element(triangle_corners, 3 * triangle).xyz;
  vec3 ab = element(triangle_corners, 3 * triangle + 1).xyz - a;
  vec3 ac = element(triangle_corners, 3 * triangle + 2).xyz - a;
  vec3 across = cross(ab, ac);
  return vec2(dot(cross(point - a, ac), across), dot(cross(ab, point - a), across)) / dot(across, across);
}

/* Surface at `barycentric` of `triangle` seen along `direction`; `spread` is the angular width of the view, radians. */
Surface resolve_surface(int triangle, vec2 barycentric, vec3 origin, vec3 direction, float spread)
{
  Surface surface;
  vec3 a = element(triangle_corners, 3 * triangle).xyz;
  vec3 b = element(triangle_corners, 3 * triangle + 1).xyz;
  vec3 c = element(triangle_corners, 3 * triangle + 2).xyz;
  vec3 geometric = cross(b - a, c - a);
  surface.position = meet_plane(a, b, c, geometric, interpolate(a, b, c, barycentric), origin, direction);
  surface.back = dot(geometric, direction) > 0.0;
  vec4 n0 = element(triangle_attributes, 5 * triangle);
  vec4 n1 = element(triangle_attributes, 5 * triangle + 1);
  vec4 n2 = element(triangle_attributes, 5 * triangle + 2);
  surface.normal = normalize(interpolate(n0.xyz, n1.xyz, n2.xyz, barycentric));
  surface.normal = surface.back ? -surface.normal : surface.normal;
  surface.object = int(n1.w);
  int material = int(n0.w);
  vec4 base = element(materials, 3 * material);
  vec4 emission = element(materials, 3 * material + 1);
  surface.albedo = base.rgb;
  surface.emission = emission.rgb;
  surface.emitter_density = element(triangle_attributes, 5 * triangle + 4).z;
#ifdef HAS_IMAGES
  if (max(base.w, emission.w) >= 0.0) {
    vec2 uv = triangle_uv(triangle, barycentric);
    float slant = max(abs(dot(normalize(geometric), direction)), 0.1);
    float footprint = length(surface.position - origin) * spread * inversesqrt(slant) * n2.w;
    if (base.w >= 0.0) {
      surface.albedo *= sample_image(int(base.w), uv, footprint).rgb;
    }
    if (emission.w >= 0.0) {
      surface.emission *= sample_image(int(emission.w), uv, footprint).rgb;
    }
  }
#endif
#ifdef HAS_FAINT_GLOSS
  send_faint_gloss(surface, material, -dot(surface.normal, direction));
#endif
  return surface;
}
