/* What probes see of sampled emitters, added to the field once the bounces have settled.
 *
 * Two ways, each where it is denser: texels, which carry emitters that fill many of them, and points on the emitters, which carry
 * those that fall between texel centres. Every place on an emitter belongs to one of the two. Texel centres are not random, so
 * weights that mix the two would not sum to one over a small emitter.
 * A point is one of CANDIDATES, chosen by what it would send if nothing stood between; `samples` of them get a ray.
 * Dispatch: one group of GROUP threads a probe; fixed order of summation.
 */

SHARED_ vec4 partial_sums[COEFFICIENTS * GROUP];

/* Candidate points on emitters per steradian, as a probe sees them. */
float point_density(float density, float squared_distance, float cosine)
{
  return float(samples * CANDIDATES) * density * squared_distance / cosine;
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
    vec3 best_radiance = vec3(0.0), best_direction = vec3(0.0);
    float best_distance = 0.0, best_weight = 0.0, total = 0.0;
    float choice = sample_r3(key + uvec3(0x68E31DA4u, 0u, 0u), i).x;
    for (int j = 0; j < CANDIDATES; j++) {
      EmitterSample emitter = sample_emitter(sample_r3(key, i * CANDIDATES + j));
      vec3 offset = emitter.point - slot.xyz;
      float squared = max(dot(offset, offset), 1.0e-20);
      float distance = sqrt(squared);
      vec3 direction = offset / distance;
      float density = point_density(emitter.density, squared, max(abs(dot(direction, emitter.normal)), 1.0e-4));
      ivec2 texel = direction_texel(direction);
      bool in_texels = density * element(texel_weights, (texel.y % FACE) * FACE + texel.x).x < 1.0;
      vec3 radiance = in_texels ? vec3(0.0) : emitter.radiance / density;
      float weight = radiance.r + radiance.g + radiance.b;
      total += weight;
      if (weight > 0.0 && choice * total < weight) {
        choice = choice * total / weight;
        best_radiance = radiance;
        best_direction = direction;
        best_distance = distance;
        best_weight = weight;
      }
      else if (total > weight) {
        choice = (choice * total - weight) / (total - weight);
      }
    }
    if (best_weight > 0.0 && !trace_any(slot.xyz, best_direction, best_distance * 0.9999)) {
      sh_basis(best_direction, basis);
      for (int c = 0; c < COEFFICIENTS; c++) {
        sum[c] += best_radiance * (basis[c] * total / best_weight);
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
