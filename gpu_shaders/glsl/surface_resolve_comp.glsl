/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Texel surfaces from hits: everything about a texel that does not change when only lights change.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Reads layer probe·6 + face of `hits`, writes
 * layer first_layer + probe of:
 *   geometry  octahedral normal, signed distance (negative: back face; NO_SURFACE: background), triangle
 *   albedo    diffuse albedo; texel_patches_comp later adds the patch
 *   emission  emitted radiance, density where it is sampled as a light, 0 where it is not; the world's radiance
 *             where the texel sees background
 * Albedo and emission are what arrives of them at the probe, through coloured holes.
 */

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  int face = id.y / FACE;
  vec4 hit = texelFetch(hits, ivec3(id.x, id.y - face * FACE, id.z * 6 + face), 0);
  ivec3 target = ivec3(id.xy, first_layer + id.z);
  vec3 origin = element(probe_slots, first_slot + id.z).xyz;
  vec3 direction = texel_direction(id.xy);
  if (hit.x < 0.0) {
    imageStore(geometry, target, vec4(0.0, 0.0, NO_SURFACE, 0.0));
    imageStore(albedo, target, vec4(0.0));
    vec3 background = element(world_texels, id.y * FACE + id.x).rgb * passed_to(origin, direction, NO_HIT);
    imageStore(emission, target, vec4(background, 0.0));
    return;
  }
  Surface surface = resolve_surface(int(hit.x), hit.yz, origin, direction, 2.0 / float(FACE));
  float distance = max(dot(surface.position - origin, direction), 1.0e-20);
  imageStore(geometry, target, vec4(octahedral_encode(surface.normal), surface.back ? -distance : distance, hit.x));
  vec3 passed = passed_to(origin, direction, distance * 0.9999);
  imageStore(albedo, target, vec4(surface.albedo * passed, 0.0));
  imageStore(emission, target, vec4(surface.emission * passed, surface.emitter_density));
}
