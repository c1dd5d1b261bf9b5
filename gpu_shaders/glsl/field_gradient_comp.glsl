/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How the field of each probe changes where the probe moves: from the edges between texels, and `emitted_gradient`,
 * which emission_project_comp found for points on sampled emitters. Formula, sources and reference: core/gradients.py.
 *
 * texel_edges, 2 elements an edge: tangent across it times its length, texel on one side | direction of its middle,
 *   texel beyond
 * probe_layers, 1 element a probe of the dispatch: its layer; its slot is that much after first_slot
 * field_gradient, 3 · COEFFICIENTS elements a slot: axis by axis
 * Dispatch: one group of GROUP threads a probe.
 */

/* Radiance that a texel sends, and one over its distance: 0 for background, −1 for a dark back face. */
vec4 texel_seen(int texel, int probe, int layer)
{
  ivec3 at = ivec3(texel % FACE, texel / FACE, layer);
  vec4 emitted = texelFetch(emission, at, 0);
  int own = own_texels != 0 ? probe * 6 * FACE * FACE + texel : -1;
  vec3 radiance = texel_reflected(at, own) * 0.3183098861837907 + (emitted.a == 0.0 ? emitted.rgb : texel_emitter(at));
  float distance = texelFetch(geometry, at, 0).z;
  if (distance < 0.0 && radiance == vec3(0.0)) {
    return vec4(0.0, 0.0, 0.0, -1.0);
  }
  return vec4(radiance, abs(distance) < NO_SURFACE ? 1.0 / max(abs(distance), nearest) : 0.0);
}

void main()
{
  int probe = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  int layer = int(element(probe_layers, probe).x);
  int slot = first_slot + layer;
  vec3 sum[3 * COEFFICIENTS];
  for (int i = 0; i < 3 * COEFFICIENTS; i++) {
    sum[i] = vec3(0.0);
  }
  for (int edge = lane; edge < 12 * FACE * FACE; edge += GROUP) {
    vec4 across = element(texel_edges, 2 * edge);
    vec4 middle = element(texel_edges, 2 * edge + 1);
    vec4 first = texel_seen(int(across.w), probe, layer);
    vec4 second = texel_seen(int(middle.w), probe, layer);
    if (first.w < 0.0 || second.w < 0.0) {
      continue;
    }
    vec3 change = (second.rgb - first.rgb) * max(first.w, second.w);
    float basis[COEFFICIENTS];
    sh_basis(middle.xyz, basis);
    for (int c = 0; c < COEFFICIENTS; c++) {
      vec3 part = change * basis[c];
      sum[c] += part * across.x;
      sum[COEFFICIENTS + c] += part * across.y;
      sum[2 * COEFFICIENTS + c] += part * across.z;
    }
  }
  for (int axis = 0; axis < 3; axis++) {
    barrier();
    for (int c = 0; c < COEFFICIENTS; c++) {
      partial_sums[c * GROUP + lane] = vec4(sum[axis * COEFFICIENTS + c], 0.0);
    }
    barrier();
    for (int c = lane; c < COEFFICIENTS; c += GROUP) {
      int index = (slot * 3 + axis) * COEFFICIENTS + c;
      vec3 sum = group_sum(c) + element(emitted_gradient, index).rgb;
      imageStore(field_gradient, element_position(index), vec4(sum, 0.0));
    }
  }
}
