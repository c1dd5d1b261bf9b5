/* What probes see of sampled emitters, added to the field once the bounces have settled.
 *
 * Two ways, each where it is denser: texels, which carry emitters that fill many of them, and `samples` points on the emitters, which
 * carry those that fall between texel centres. Every place on an emitter belongs to one of the two. Texel centres are not random, so
 * weights that mix the two would not sum to one over a small emitter.
 * Dispatch: one group of GROUP threads a probe; fixed order of summation.
 */

SHARED_ vec4 partial_sums[COEFFICIENTS * GROUP];

/* Points on emitters per steradian, as a probe sees them. */
float point_density(float density, float squared_distance, float cosine)
{
  return float(samples) * density * squared_distance / cosine;
}

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
      float weight = element(texel_weights, (at.y % FACE) * FACE + at.x).x;
      if (point_density(emitted.a, seen.z * seen.z, cosine) * weight < 1.0) {
        sh_basis(direction, basis);
        for (int c = 0; c < COEFFICIENTS; c++) {
          sum[c] += emitted.rgb * (basis[c] * weight);
        }
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
    float cosine = max(abs(dot(direction, emitter.normal)), 1.0e-4);
    float density = point_density(emitter.density, squared, cosine);
    ivec2 texel = direction_texel(direction);
    float weight = element(texel_weights, (texel.y % FACE) * FACE + texel.x).x;
    if (density * weight >= 1.0 && !trace_any(slot.xyz, direction, distance * 0.9999)) {
      sh_basis(direction, basis);
      for (int c = 0; c < COEFFICIENTS; c++) {
        sum[c] += emitter.radiance * (basis[c] / density);
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
