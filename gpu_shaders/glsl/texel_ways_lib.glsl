/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Places all over what a texel shows, for what is smaller than a texel. */

/* The ray through `place` (0..1) of a texel to the plane of what its `middle` has met; the middle itself where that
 * slants too much. */
Way way_through(vec2 place, Way middle, vec3 origin, ivec2 texel)
{
  Way way = middle;
  vec3 geometric = triangle_normal(middle.hit.triangle, -middle.direction);
  vec3 direction = texel_place_direction(texel, place);
  float slope = dot(geometric, direction), distance = dot(geometric, middle.surface.position - origin) / slope;
  if (slope > -0.01 || distance > 2.0 * middle.hit.distance) {
    return way;
  }
  way.direction = direction;
  way.hit.distance = distance;
  way.surface.position = origin + distance * direction;
  vec2 barycentric = barycentric_of(middle.hit.triangle, way.surface.position);
  int first = 5 * middle.hit.triangle;
  vec3 normal = normalize(interpolate(element(triangle_attributes, first).xyz,
                                      element(triangle_attributes, first + 1).xyz,
                                      element(triangle_attributes, first + 2).xyz, barycentric));
  way.surface.normal = middle.surface.back ? -normal : normal;
  return way;
}

/* How far facets that mirror one way turn from one side of the texel to the other, radians. */
float turn_over(Way middle, vec3 origin, ivec2 texel)
{
  vec3 left = way_through(vec2(0.1, 0.5), middle, origin, texel).surface.normal;
  vec3 right = way_through(vec2(0.9, 0.5), middle, origin, texel).surface.normal;
  vec3 low = way_through(vec2(0.5, 0.1), middle, origin, texel).surface.normal;
  vec3 high = way_through(vec2(0.5, 0.9), middle, origin, texel).surface.normal;
  float bend = 1.25 * max(length(right - left), length(high - low));
  return 0.5 * 1.5707963267948966 / float(FACE) + bend;
}

/* What the ray through the middle of a texel has met on `triangle`. */
Way met_in_middle(int triangle, float distance, vec3 origin, vec3 direction)
{
  vec2 barycentric = barycentric_of(triangle, origin + direction * distance);
  Surface surface = resolve_surface(triangle, barycentric, origin, direction, 2.0 / float(FACE));
  vec2 inside = max(barycentric, vec2(0.0)); /* rasterised triangles reach over their edges, see texel_hits_comp */
  inside /= max(inside.x + inside.y, 1.0);
  if (inside != barycentric) {
    barycentric = inside;
    surface.position = interpolate(element(triangle_corners, 3 * triangle).xyz,
                                   element(triangle_corners, 3 * triangle + 1).xyz,
                                   element(triangle_corners, 3 * triangle + 2).xyz, inside);
  }
  return Way(direction, Hit(distance, triangle, barycentric), surface, vec3(1.0), vec3(0.0));
}
