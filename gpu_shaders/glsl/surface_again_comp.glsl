/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Albedo and emission of texels anew, from the triangles that they hit before: for other materials, another world, or
 * triangles with other numbers. No ray is traced.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1; layer = probe. With RENUMBER, new_numbers holds
 * the new number of each old triangle, −1 where it is gone (its texels are to be captured again). Writes 1 to `rebind`
 * if a texel that reflected nothing now
 * does, or the other way round: then patches must be found anew.
 */

void main()
{
  ivec3 at = ivec3(gl_GlobalInvocationID);
  if (at.x >= FACE || at.y >= 6 * FACE) {
    return;
  }
  vec4 seen = imageLoad(geometry, at);
  vec3 origin = element(probe_slots, first_slot + at.z).xyz;
  vec3 direction = texel_direction(at.xy);
  if (seen.z >= NO_SURFACE) {
    vec3 background = element(world_texels, at.y * FACE + at.x).rgb * passed_to(origin, direction, NO_HIT);
    imageStore(emission, at, vec4(background, 0.0));
    return;
  }
#ifdef RENUMBER
  seen.w = element(new_numbers, int(seen.w)).x;
  if (seen.w < 0.0) {
    return;
  }
  imageStore(geometry, at, seen);
#endif
  vec2 barycentric = barycentric_of(int(seen.w), origin + direction * abs(seen.z));
  Surface surface = resolve_surface(int(seen.w), barycentric, origin, direction, 2.0 / float(FACE));
  vec4 reflects = imageLoad(albedo, at);
  vec3 passed = passed_to(origin, direction, abs(seen.z) * 0.9999);
  surface.albedo *= passed;
  surface.emission *= passed;
#ifdef HAS_GLOSS
  bool is_glossy = gloss_of(int(seen.w)).share != vec3(0.0); /* other gloss than before is found by the host */
#else
  const bool is_glossy = false;
#endif
  if (!is_glossy && (reflects.rgb != vec3(0.0)) != (surface.albedo != vec3(0.0))) {
    imageStore(rebind, ivec2(0), vec4(1.0));
  }
  imageStore(albedo, at, vec4(surface.albedo, reflects.w));
  imageStore(emission, at, vec4(surface.emission, surface.emitter_density));
}
