/* One light iteration, fused: outgoing radiance of every texel (source + albedo/π · irradiance of the last field) and its projection to
 * SH. Each bounce is one dispatch, nothing is captured again.
 *
 * Dispatch: one group of GROUP threads a probe. Threads take texels in strides, then each coefficient is summed over the threads in
 * fixed order, so two runs give the same bytes. Reference: core/reference_bake.py.
 */

SHARED_ vec4 partial_sums[COEFFICIENTS * GROUP];

void main()
{
  int probe = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  int layer = first_layer + probe;
  vec3 sum[COEFFICIENTS];
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] = vec3(0.0);
  }
  for (int i = lane; i < 6 * FACE * FACE; i += GROUP) {
    ivec3 at = ivec3(i % FACE, i / FACE, layer);
    vec3 radiance = texelFetch(source, at, 0).rgb;
    if (read_field != 0) {
      vec3 reflectance = texelFetch(albedo, at, 0).rgb * 0.3183098861837907;
      vec4 seen = texelFetch(geometry, at, 0);
      if (seen.w >= 0.0 && reflectance != vec3(0.0)) {
        vec4 low = texelFetch(weights0, at, 0);
        vec4 high = texelFetch(weights1, at, 0);
        float total = dot(low + high, vec4(1.0)); /* half floats do not sum to 1 exactly */
        vec3 irradiance = field_irradiance(int(seen.w), low, high, octahedral_decode(seen.xy)) / total;
        radiance += reflectance * max(irradiance, vec3(0.0));
      }
    }
    float basis[COEFFICIENTS];
    sh_basis(texel_direction(at.xy), basis);
    radiance *= element(texel_weights, (at.y % FACE) * FACE + at.x).x;
    for (int c = 0; c < COEFFICIENTS; c++) {
      sum[c] += radiance * basis[c];
    }
  }
  for (int c = 0; c < COEFFICIENTS; c++) {
    partial_sums[c * GROUP + lane] = vec4(sum[c], 0.0);
  }
  barrier();
  for (int c = lane; c < COEFFICIENTS; c += GROUP) {
    vec3 total = vec3(0.0);
    for (int i = 0; i < GROUP; i++) {
      total += partial_sums[c * GROUP + i].rgb;
    }
    int node = int(element(probe_slots, first_slot + probe).w);
    imageStore(field_out, element_position(node * COEFFICIENTS + c), vec4(total, 0.0));
  }
}
