/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which way light takes that is mirrored at glossy surfaces. Shaders that follow it trace the rays, see ray_lib.
 *
 * Reference: core/reference_gloss.py.
 */

/* Is the way mirrored on at the surface that it has met? Else `surface.albedo` becomes what it finds sent diffusely. */
bool is_mirrored(inout Way way, Gloss gloss, uvec3 event, out Reflection reflection)
{
  if (gloss.share == vec3(0.0)) {
    return false;
  }
  vec3 numbers = unit_numbers(event);
  reflection = reflect_at(gloss, way.surface, way.hit.triangle, -way.direction, event, numbers.yz);
  float mirrored = reflection.mirrored.r + reflection.mirrored.g + reflection.mirrored.b;
  float diffuse = reflection.diffuse.r + reflection.diffuse.g + reflection.diffuse.b;
  float chance = mirrored / max(mirrored + diffuse, 1.0e-30);
  if (numbers.x >= chance) {
    way.surface.albedo = reflection.diffuse / (1.0 - chance);
    return false;
  }
  way.throughput /= chance;
  return true;
}

/* Emission of a surface met by a ray that left a lobe of this width, as far as points on emitters do not answer for it;
 * in scenes with light linking the next surface is lit from here on. */
vec3 emission_met_in_gloss(Way way, float width)
{
  vec3 emission = way.surface.emission *
                  emitter_share_of_rays(way.surface, way.hit.triangle, way.direction, way.hit.distance, width);
#ifdef HAS_LINKS
  lit_role = role_of_triangle(way.hit.triangle);
#endif
  return emission;
}
