/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The scene as the field lights it, without a window: camera rays and what viewport_shade_lib shows of what they hit,
 * and probe spheres.
 *
 * Dispatch: one thread a pixel, one sample each; groups of 64: of the pixels in `chosen` (their numbers, row by row
 * from the bottom), or where chosen_count is −1 of all, in squares of 8×8. Adds linear radiance to `picture` and, with
 * the probes as spheres in it, to `probe_picture`; sample_index 0 overwrites. Alpha counts samples; in views that show
 * no light, those that hit something.
 * view_info: as in viewport_surface_vert, of which the matrix is not used
 * spheres: as core/sphere_tiles.py lists them by tile: centre, node of the grid, −1 culled, −2 invalid
 */

#ifdef HAS_FIELD
/* Nearest sphere along the ray: distance and its index in `sphere`, NO_HIT where none is hit. */
float intersect_spheres(int tile, vec3 origin, vec3 direction, out int sphere)
{
  float nearest = NO_HIT;
  sphere = -1;
  vec4 range = element(spheres, tile);
  for (int i = int(range.x); i < int(range.x + range.y); i++) {
    vec4 centre = element(spheres, i);
    float radius = sphere_radius * (centre.w < 0.0 ? 0.5 : 1.0);
    vec3 offset = centre.xyz - origin;
    float along = dot(offset, direction);
    float miss = dot(offset, offset) - along * along;
    float half_chord = radius * radius - miss;
    if (half_chord > 0.0) {
      float distance = along - sqrt(half_chord);
      if (distance > 0.0 && distance < nearest) {
        nearest = distance;
        sphere = i;
      }
    }
  }
  return nearest;
}
#endif

void main()
{
  ivec2 size = imageSize(picture), pixel;
  if (chosen_count < 0) {
    int square = LINEAR_THREAD / 64, inside = LINEAR_THREAD % 64, row = (size.x + 7) / 8;
    pixel = 8 * ivec2(square % row, square / row) + ivec2(inside % 8, inside / 8);
  }
  else {
    int number = LINEAR_THREAD < chosen_count ? int(imageLoad(chosen, element_position(LINEAR_THREAD)).x) : -1;
    pixel = number < 0 ? size : ivec2(number % size.x, number / size.x);
  }
  if (pixel.x >= size.x || pixel.y >= size.y) {
    return;
  }
  vec2 place = (vec2(pixel) + sample_r2(uvec3(pixel, 7u), sample_index)) / vec2(size) * 2.0 - 1.0;
  vec3 across = view_info[1].xyz * place.x + view_info[2].xyz * place.y;
  bool orthographic = view_info[0].w != 0.0;
  vec3 origin = view_info[0].xyz + (orthographic ? across : vec3(0.0));
  vec3 direction = normalize(view_info[3].xyz + (orthographic ? vec3(0.0) : across));

  Hit hit = trace_view(origin, direction);
  vec4 seen = vec4(0.0);
  if (hit.triangle >= 0) {
    Surface surface = resolve_surface(hit.triangle, hit.barycentric, origin, direction, view_info[3].w);
    seen = vec4(shade_surface(surface, hit.triangle, direction, hit.distance, pixel_key(pixel), sample_index), 1.0);
  }
  else if (shows_light()) {
    ivec2 texel = direction_texel(direction);
    seen = vec4(element(world_texels, texel.y * FACE + texel.x).rgb, 1.0);
  }
  vec4 before = sample_index == 0 ? vec4(0.0) : imageLoad(picture, pixel);
  imageStore(picture, pixel, before + seen);

#ifdef HAS_FIELD
  int sphere;
  ivec2 tile = pixel / TILE;
  float sphere_distance = intersect_spheres(tile.y * ((size.x + TILE - 1) / TILE) + tile.x, origin, direction, sphere);
  if (sphere_distance < hit.distance) {
    vec4 centre = element(spheres, sphere);
    seen = vec4(shade_probe(int(centre.w), normalize(origin + direction * sphere_distance - centre.xyz)), 1.0);
  }
#endif
  before = sample_index == 0 ? vec4(0.0) : imageLoad(probe_picture, pixel);
  imageStore(probe_picture, pixel, before + seen);
}
