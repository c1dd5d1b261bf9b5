/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the preview shows of surfaces; needs viewport_data_lib. */

/* Reflected light of all lamps: diffuse, and a Phong lobe scaled to keep its energy (Lafortune and Willems, 1994). */
vec3 lamps_radiance(Surface surface, vec3 direction, vec3 origin, uvec3 key, int index)
{
  vec3 mirrored = reflect(direction, surface.normal);
  float exponent = shade_info[1].z;
  float highlight = shade_info[1].y * (exponent + 2.0) * 0.15915494309189535;
  vec3 sum = vec3(0.0);
  for (int number = 0; number < lamp_rays(); number++) {
    ShadowRay ray = lamp_ray(number, surface.position, origin, surface.normal, key, index);
    vec3 irradiance = brought_by(ray);
    if (irradiance != vec3(0.0)) {
      vec3 reflected = surface.albedo * 0.3183098861837907;
      if (highlight > 0.0) {
        reflected += highlight * pow(max(dot(mirrored, ray.direction), 0.0), exponent);
      }
      sum += reflected * irradiance;
    }
  }
  return sum;
}

#ifdef HAS_FIELD
vec3 field_irradiance_at(vec3 point, vec3 normal)
{
  return max(field_irradiance(point - shade_info[0].xyz, normal), vec3(0.0));
}

/* Validity blended as the grid lies in space, or the cell's error. */
vec3 data_color(vec3 point)
{
  vec3 beyond;
  vec3 lattice = lattice_position(point - shade_info[0].xyz, beyond);
  ivec3 cell = first_corner(lattice);
  if (shade_mode() == ERROR) {
    return heat_color(element(node_marks, node_index(cell)).z / FULL_SCALE_ERROR);
  }
  vec3 blend = lattice - vec3(cell);
  vec3 color = vec3(0.0);
  for (int corner = 0; corner < 8; corner++) {
    ivec3 step = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    vec3 part = mix(1.0 - blend, blend, vec3(step));
    float weight = part.x * part.y * part.z;
    if (weight > 0.0) {
      color += weight * state_color(node_index(cell + step));
    }
  }
  return color;
}
#endif

/* What a surface sends of the light on the side of its normal; `towards`: to where its ray came from. */
vec3 side_radiance(Surface surface, vec3 direction, vec3 towards, float distance, uvec3 key, int index)
{
  int mode = shade_mode();
  vec3 radiance = vec3(0.0);
#ifdef HAS_FIELD
  if (mode != DIRECT) {
    radiance = surface.albedo * 0.3183098861837907 * shade_info[1].x *
               field_irradiance_at(surface.position, surface.normal);
  }
#endif
  if (mode != INDIRECT) {
    vec3 origin = step_off(surface.position, surface.normal, towards, distance);
    radiance += lamps_radiance(surface, direction, origin, key, index);
  }
  return radiance;
}

/* What is shown of a surface on `triangle` that a ray along `direction` met after `distance`. */
vec3 shade_surface(Surface surface, int triangle, vec3 direction, float distance, uvec3 key, int index)
{
  int mode = shade_mode();
  if (mode == NORMALS) {
    return display_to_linear(surface.normal * 0.5 + 0.5);
  }
#ifdef HAS_FIELD
  if (mode >= VALIDITY) {
    float facing = 0.6 + 0.4 * abs(dot(surface.normal, direction));
    return display_to_linear(data_color(surface.position) * facing);
  }
  if (mode == IRRADIANCE) {
    return shade_info[1].x * field_irradiance_at(surface.position, surface.normal) * 0.3183098861837907;
  }
#else
  if (mode >= VALIDITY) {
    return vec3(0.1);
  }
  if (mode == IRRADIANCE) {
    return vec3(0.0);
  }
#endif
#ifdef HAS_LINKS
  lit_role = role_of_triangle(triangle);
#endif
  vec3 radiance = side_radiance(surface, direction, -direction, distance, key, index);
#ifdef HAS_SHEETS
  vec3 through = share_of_back(sheet_of_triangle(triangle));
  if (through != vec3(0.0)) {
    surface.normal = -surface.normal;
    vec3 behind = side_radiance(surface, direction, direction, distance, key + uvec3(0u, BACK_STREAM, 0u), index);
    radiance = mix(radiance, behind, through);
  }
#endif
  return mode == INDIRECT ? radiance : radiance + surface.emission;
}

/* One key a pixel, so that soft shadows look the same in every kind of picture. */
uvec3 pixel_key(ivec2 pixel)
{
  return uvec3(uint(pixel.x), uint(pixel.y), 0x51ED270Bu);
}
