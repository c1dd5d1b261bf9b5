/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rays that go on from surface to surface until they leave the scene. Samplers: world_texels. */

/* The way goes on from `origin` to the next surface; false where there is none. `spread`: see resolve_surface. */
bool advance(inout Way way, vec3 origin, float spread)
{
  way.hit = trace_closest(origin, way.direction);
  way.throughput *= passed_to(origin, way.direction, way.hit.distance);
  if (way.hit.triangle < 0) {
    return false;
  }
  way.surface = resolve_surface(way.hit.triangle, way.hit.barycentric, origin, way.direction, spread);
  return true;
}

/* Radiance of the world. */
vec3 world_along(vec3 direction)
{
  ivec2 texel = direction_texel(direction);
  return element(world_texels, texel.y * FACE + texel.x).rgb;
}
