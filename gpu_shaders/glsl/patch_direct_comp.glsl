/* Direct light of patches: irradiance of lamps and sampled emitters, mean over `samples` places spread over the patch's points.
 *
 * Dispatch: one thread an entry of `patches`; groups of 64. The key of a number is (first_key + patch, light, seed); its index counts samples, so the
 * points of a patch share one stratified sequence.
 * patch_points, POINTS elements a patch: position, packed normal. patches: index of a patch in x.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= patch_count) {
    return;
  }
  int patch_index = int(element(patches, entry).x);
  uvec3 key = uvec3(uint(first_key + patch_index), 0u, uint(seed));
  vec3 irradiance = vec3(0.0);
  for (int i = 0; i < samples; i++) {
    int place = samples < POINTS ? i * POINTS / samples : i % POINTS;
    vec4 at = element(patch_points, POINTS * patch_index + place);
    vec3 normal = unpack_normal(at.w);
    vec3 origin = leave_surface(at.xyz, normal);
    irradiance += lamps_irradiance(at.xyz, origin, normal, key, i);
#ifdef HAS_EMITTERS
    irradiance += emitter_irradiance(at.xyz, origin, normal, key + uvec3(0u, 0u, 0x2545F491u), i);
#endif
  }
  imageStore(direct, element_position(patch_index), vec4(irradiance / float(samples), 0.0));
}
