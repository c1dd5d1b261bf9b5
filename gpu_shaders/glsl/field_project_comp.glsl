/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Outgoing radiance of every texel (emission that is not sampled + albedo/π · irradiance of its patch), projected to
 * SH, and `emitted`, what emission_project_comp found of sampled emitters.
 *
 * With own_texels the irradiance of texel i of the dispatch's probe p is element p · 6 · FACE² + i.
 * probe_layers, 1 element a probe of the dispatch: its layer; its slot is that much after first_slot
 * Dispatch: one group of GROUP threads a probe. Threads take texels in strides. Reference: core/reference_bake.py.
 */

void main()
{
  int probe = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  int layer = int(element(probe_layers, probe).x);
  vec3 sum[COEFFICIENTS];
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] = vec3(0.0);
  }
  for (int i = lane; i < 6 * FACE * FACE; i += GROUP) {
    ivec3 at = ivec3(i % FACE, i / FACE, layer);
    vec4 emitted = texelFetch(emission, at, 0);
    int own = own_texels != 0 ? probe * 6 * FACE * FACE + i : -1;
    vec3 radiance = texel_reflected(at, own) * 0.3183098861837907 + (emitted.a == 0.0 ? emitted.rgb : vec3(0.0));
    add_texel(sum, at, radiance);
  }
  for (int c = 0; c < COEFFICIENTS; c++) {
    partial_sums[c * GROUP + lane] = vec4(sum[c], 0.0);
  }
  barrier();
  for (int c = lane; c < COEFFICIENTS; c += GROUP) {
    int index = (first_slot + layer) * COEFFICIENTS + c;
    imageStore(field, element_position(index), vec4(group_sum(c) + element(emitted, index).rgb, 0.0));
  }
}
