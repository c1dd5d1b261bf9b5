/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Direct light of patches: irradiance of lamps and sampled emitters at `samples` places spread over the patch's points.
 *
 * Dispatch: a thread for samples_each of the samples of a patch, see patch_lists_lib; groups of 64. patch_mean_comp
 * puts them together. (A thread for all samples of a patch would be simpler, but software drivers end every loop of a
 * thread that has gone round 65 535 times.) Fewer samples than points take one of each equal run of points, all the
 * same one of their runs, which is random. The key of a number is (first_key + patch, light, seed); its index counts
 * samples, so the points of a patch share one stratified sequence.
 * patch_points, POINTS elements a patch: position, packed normal. patches: index of a patch in x. sheet_numbers: of
 * each patch.
 * couplings: of each patch, see coupling_lib.
 */

/* Drivers that unroll its loops compile this for twice as long, and run it no faster. */
#pragma optionNV(unroll none)

vec3 irradiance_of_side(vec3 point, vec3 normal, uvec3 key, int index)
{
  vec3 origin = leave_surface(point, normal), irradiance = vec3(0.0);
  uvec3 emitter_key = key + uvec3(0u, 0u, 0x2545F491u);
  for (int ray = 0; ray < light_rays(); ray++) {
    irradiance += brought_by(light_ray(ray, point, origin, normal, key, emitter_key, index));
  }
#ifdef HAS_EMITTERS
  irradiance += emitter_direction_irradiance(origin, normal, emitter_key, index);
#endif
  return irradiance;
}

void main()
{
  /* Groups come from both ends in turn: software drivers give each core one run of them, and the lists differ in
   * work. */
  int group = LINEAR_THREAD / 64;
  int from_end = int(gl_NumWorkGroups.x * gl_NumWorkGroups.y) - 1 - group / 2;
  int thread_number = 64 * (group % 2 == 0 ? group / 2 : from_end) + int(gl_LocalInvocationID.x);
  Entry entry = entry_of_run(thread_number);
  if (entry.list == LISTS) {
    return;
  }
  int samples = list_samples[entry.list];
  int first = entry.run * samples_each;
  int patch_index = patch_of(entry);
  uvec3 key = uvec3(uint(first_key + patch_index), 0u, uint(seed));
  int shift = int(pcg3d(key + uvec3(0u, 0x85EBCA6Bu, 0u)).x % uint(POINTS));
  vec3 irradiance = vec3(0.0);
#ifdef HAS_COUPLING
  coupling = element(couplings, 2 * patch_index);
#endif
#ifdef HAS_LINKS
  lit_role = role_of_sheet(int(element(sheet_numbers, patch_index).x));
#endif
  for (int i = first; i < min(first + samples_each, samples); i++) {
    int place = samples < POINTS ? (i * POINTS + shift) / samples : i % POINTS;
    vec4 at = element(patch_points, POINTS * patch_index + place);
    vec3 normal = unpack_normal(at.w);
#ifdef HAS_SHEETS
    vec3 through = share_of_back(int(element(sheet_numbers, patch_index).x));
    for (int side = 0; side < (through == vec3(0.0) ? 1 : 2); side++) {
      uvec3 side_key = key + uvec3(0u, side == 0 ? 0u : BACK_STREAM, 0u);
      vec3 of_side = irradiance_of_side(at.xyz, side == 0 ? normal : -normal, side_key, i);
      irradiance += (side == 0 ? 1.0 - through : through) * of_side;
    }
#else
    irradiance += irradiance_of_side(at.xyz, normal, key, i);
#endif
  }
  imageStore(sums, element_position(thread_number), vec4(irradiance, 0.0));
}
