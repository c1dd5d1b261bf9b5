/* The scene as the field lights it: camera rays, direct light and the field's lookup at what they hit, and probe spheres.
 *
 * Dispatch: x, y = pixels, one sample a pixel; groups of 8×8×1. Adds linear radiance to `picture` and, with the probes as spheres in
 * it, to `probe_picture`; sample_index 0 overwrites.
 * view_info: camera position, 1 if orthographic | right and up axes scaled to the edge of the image | forward |
 *            sphere radius, sphere count
 * spheres, 1 element each: centre, node of the grid (≥ 0: shaded with that node's irradiance; −1 culled, −2 invalid)
 */

vec3 shade_surface(Surface surface, vec3 direction, float distance, uvec3 key)
{
  vec3 reflectance = surface.albedo * 0.3183098861837907;
  vec3 radiance = surface.emission;
  if (reflectance == vec3(0.0)) {
    return radiance;
  }
  vec3 irradiance = vec3(0.0);
  vec3 origin = step_off(surface.position, surface.normal, -direction, distance);
  if (show_direct != 0) {
    irradiance = lamps_irradiance(surface.position, origin, surface.normal, key, sample_index);
  }
  float weights[8];
  int first_node = node_index(lookup_cell(surface.position, surface.normal, weights));
  vec3 indirect = field_irradiance(first_node, vec4(weights[0], weights[1], weights[2], weights[3]),
                                   vec4(weights[4], weights[5], weights[6], weights[7]), surface.normal);
  return radiance + reflectance * (irradiance + max(indirect, vec3(0.0)));
}

/* Nearest sphere along the ray: distance and its index in `sphere`, NO_HIT where none is hit. */
float intersect_spheres(vec3 origin, vec3 direction, out int sphere)
{
  float nearest = NO_HIT;
  sphere = -1;
  for (int i = 0; i < int(view_info[4].y); i++) {
    vec4 centre = element(spheres, i);
    float radius = view_info[4].x * (centre.w < 0.0 ? 0.5 : 1.0);
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

vec3 shade_sphere(int sphere, vec3 point)
{
  vec4 centre = element(spheres, sphere);
  if (centre.w < 0.0) {
    return centre.w < -1.5 ? vec3(0.4, 0.02, 0.02) : vec3(0.05);
  }
  return max(field_irradiance(int(centre.w), vec4(1.0, 0.0, 0.0, 0.0), vec4(0.0), normalize(point - centre.xyz)), vec3(0.0)) *
         0.3183098861837907;
}

void main()
{
  ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
  ivec2 size = imageSize(picture);
  if (pixel.x >= size.x || pixel.y >= size.y) {
    return;
  }
  uvec3 key = uvec3(uint(pixel.x), uint(pixel.y), 0x51ED270Bu);
  vec2 place = (vec2(pixel) + sample_r2(uvec3(pixel, 7u), sample_index)) / vec2(size) * 2.0 - 1.0;
  vec3 across = view_info[1].xyz * place.x + view_info[2].xyz * place.y;
  bool orthographic = view_info[0].w != 0.0;
  vec3 origin = view_info[0].xyz + (orthographic ? across : vec3(0.0));
  vec3 direction = normalize(view_info[3].xyz + (orthographic ? vec3(0.0) : across));

  Hit hit = trace_closest(origin, direction);
  vec3 radiance;
  if (hit.triangle < 0) {
    ivec2 texel = direction_texel(direction);
    radiance = element(world_texels, texel.y * FACE + texel.x).rgb;
  }
  else {
    float spread = 2.0 * length(view_info[2].xyz) / float(size.y);
    Surface surface = resolve_surface(hit.triangle, hit.barycentric, origin, direction, spread);
    radiance = shade_surface(surface, direction, hit.distance, key);
  }
  vec4 before = sample_index == 0 ? vec4(0.0) : imageLoad(picture, pixel);
  imageStore(picture, pixel, before + vec4(radiance, 1.0));

  int sphere;
  float sphere_distance = intersect_spheres(origin, direction, sphere);
  if (sphere_distance < hit.distance) {
    radiance = shade_sphere(sphere, origin + direction * sphere_distance);
  }
  before = sample_index == 0 ? vec4(0.0) : imageLoad(probe_picture, pixel);
  imageStore(probe_picture, pixel, before + vec4(radiance, 1.0));
}
