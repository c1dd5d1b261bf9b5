/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What probes see of the suns of the world, added to the field: rays to their discs, as texels are far larger than
 * these and would see a sun past a window's edge or not at all. Reference: core/reference_bake.py.
 *
 * Dispatch: one group of GROUP threads a probe, each with one ray to each sun; fixed order of summation.
 * probe_layers, 1 element a probe of the dispatch: its layer; its slot is that much after first_slot
 */

void main()
{
  int lane = int(gl_LocalInvocationID.x);
  int slot_index = first_slot + int(element(probe_layers, int(gl_WorkGroupID.x)).x);
  vec4 slot = element(probe_slots, slot_index);
  vec3 sum[COEFFICIENTS];
  float basis[COEFFICIENTS];
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] = vec3(0.0);
  }
  for (int sun = first_sun; sun < light_count; sun++) {
    uvec3 key = uvec3(uint(slot.w), 0x7F4A7C15u + uint(sun - first_sun), uint(seed));
    LightSample light_sample = sample_light(sun, slot.xyz, sample_r2(key, lane));
    vec3 arriving = light_along(slot.xyz, light_sample.direction, NO_HIT, 0);
    if (arriving != vec3(0.0)) {
      sh_basis(light_sample.direction, basis);
      for (int c = 0; c < COEFFICIENTS; c++) {
        sum[c] += light_sample.irradiance * arriving * (basis[c] / float(GROUP));
      }
    }
  }
  for (int c = 0; c < COEFFICIENTS; c++) {
    partial_sums[c * GROUP + lane] = vec4(sum[c], 0.0);
  }
  barrier();
  for (int c = lane; c < COEFFICIENTS; c += GROUP) {
    ivec2 place = element_position(slot_index * COEFFICIENTS + c);
    imageStore(field, place, imageLoad(field, place) + vec4(group_sum(c), 0.0));
  }
}
