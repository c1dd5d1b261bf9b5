/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rays that go on where they are mirrored, until they end on something that sends light in all directions, or in the
 * world.
 *
 * Reference: core/reference_gloss.py. Samplers beside those of its libraries: world_texels.
 */

/* The ray goes on from its surface by `reflection`, out of a lobe of this width. */
void go_on(inout Way way, Reflection reflection, float width, bool meets_lamps, float spread)
{
  vec3 point = way.surface.position, origin = beginning(way);
  way.throughput *= reflection.mirrored;
  way.direction = reflection.direction;
  way.hit = trace_closest(origin, way.direction);
  way.throughput *= passed_to(origin, way.direction, way.hit.distance);
  if (meets_lamps) {
    way.brought += way.throughput * lamps_met(point, way.direction, way.hit.distance, width);
  }
  if (way.hit.triangle < 0) {
    ivec2 texel = direction_texel(way.direction);
    way.brought += way.throughput * element(world_texels, texel.y * FACE + texel.x).rgb;
    way.throughput = vec3(0.0);
    return;
  }
  way.surface = resolve_surface(way.hit.triangle, way.hit.barycentric, origin, way.direction, spread);
  way.brought += way.throughput * way.surface.emission *
                 emitter_share_of_rays(way.surface, way.hit.triangle, way.direction, way.hit.distance, width);
#ifdef HAS_LINKS
  lit_role = role_of_triangle(way.hit.triangle);
#endif
}

/* Follows the ray `number` of `key`, whose reflections count from `first` on, `most` of them; it sees lamps in lobes of
 * at least `blur`. Where it ends, `surface.albedo` is what it finds sent diffusely. */
void follow_reflections(inout Way way, uvec3 key, int number, int first, int most, float blur, float spread)
{
  for (int depth = first; depth < first + most && way.throughput != vec3(0.0); depth++) {
    Gloss gloss = gloss_of(way.hit.triangle);
    if (gloss.share == vec3(0.0)) {
      return;
    }
    uvec3 event = reflection_event(key, number, depth);
    vec3 numbers = unit_numbers(event);
    Reflection reflection = reflect_at(gloss, way.surface, way.hit.triangle, -way.direction, event, numbers.yz);
    float mirrored = reflection.mirrored.r + reflection.mirrored.g + reflection.mirrored.b;
    float diffuse = reflection.diffuse.r + reflection.diffuse.g + reflection.diffuse.b;
    float chance = mirrored / max(mirrored + diffuse, 1.0e-30);
    if (numbers.x >= chance) {
      way.surface.albedo = reflection.diffuse / (1.0 - chance);
      return;
    }
    way.throughput /= chance;
    float width = max(gloss.alpha, blur);
    way.brought += way.throughput * light_in_gloss(gloss, way.surface, beginning(way), -way.direction, width, event);
    go_on(way, reflection, width, true, spread);
  }
}
