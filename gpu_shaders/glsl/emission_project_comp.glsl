/* What probes see of sampled emitters, added to the field once the bounces have settled.
 *
 * Texels and `samples` points on the emitters are combined by the balance heuristic (Veach and Guibas, SIGGRAPH 1995): texels carry emitters
 * that fill many of them, points carry those that fall between texel centres.
 * Dispatch: one group of GROUP threads a probe; fixed order of summation.
 */

SHARED_ vec4 partial_sums[COEFFICIENTS * GROUP];

void main()
{
  int probe = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  int layer = first_layer + probe;
  vec4 slot = element(probe_slots, first_slot + probe);
  vec3 sum[COEFFICIENTS];
  float basis[COEFFICIENTS];
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] = vec3(0.0);
  }
  for (int i = lane; i < 6 * FACE * FACE; i += GROUP) {
    ivec3 at = ivec3(i % FACE, i / FACE, layer);
    vec4 emitted = texelFetch(emission, at, 0);
    if (emitted.a > 0.0) {
      vec4 seen = texelFetch(geometry, at, 0);
      vec3 direction = texel_direction(at.xy);
      float cosine = max(abs(dot(direction, octahedral_decode(seen.xy))), 1.0e-4);
      float point_density = float(samples) * emitted.a * seen.z * seen.z / cosine;
      float texel_density = 1.0 / element(texel_weights, (at.y % FACE) * FACE + at.x).x;
      sh_basis(direction, basis);
      for (int c = 0; c < COEFFICIENTS; c++) {
        sum[c] += emitted.rgb * (basis[c] / (texel_density + point_density));
      }
    }
  }
  uvec3 key = uvec3(uint(slot.w), 0xB5297A4Du, uint(seed));
  for (int i = lane; i < samples; i += GROUP) {
    EmitterSample emitter = sample_emitter(sample_r3(key, i));
    vec3 offset = emitter.point - slot.xyz;
    float squared = max(dot(offset, offset), 1.0e-20);
    float distance = sqrt(squared);
    vec3 direction = offset / distance;
    if (!trace_any(slot.xyz, direction, distance * 0.9999)) {
      float cosine = max(abs(dot(direction, emitter.normal)), 1.0e-4);
      float point_density = float(samples) * emitter.density * squared / cosine;
      ivec2 texel = direction_texel(direction);
      float texel_density = 1.0 / element(texel_weights, (texel.y % FACE) * FACE + texel.x).x;
      sh_basis(direction, basis);
      for (int c = 0; c < COEFFICIENTS; c++) {
        sum[c] += emitter.radiance * (basis[c] / (texel_density + point_density));
      }
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
    ivec2 target = element_position(int(slot.w) * COEFFICIENTS + c);
    imageStore(field, target, imageLoad(field, target) + vec4(total, 0.0));
  }
}
