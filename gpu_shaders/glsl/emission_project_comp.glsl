/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What probes see of sampled emitters: the part of the field that no bounce and no lamp changes; field_project_comp
 * adds it. For points on emitters also how that changes where the probe moves (core/gradients.py); field_gradient_comp
 * adds it.
 *
 * Two ways, each where it is denser: texels, which carry emitters that fill many of them, and points on the emitters,
 * which carry those that fall between texel centres. Every place on an emitter belongs to one of the two. Texel centres
 * are not random, so weights that mix the two would not sum to one over a small emitter.
 * CANDIDATE_COUNT points lie in order of the emitters and weigh what they would send if nothing stood between; RAYS of
 * them get a ray, one each time the running sum of the weights has grown by an equal step. Front, back and every part
 * of a lamp so get their exact share of the rays (systematic resampling; Kitagawa, "Monte Carlo Filter and Smoother",
 * 1996, A.1).
 * probe_layers, 1 element a probe of the dispatch: its layer; its slot is that much after first_slot
 * Dispatch: one group of GROUP threads a probe; each weighs a run of candidates; fixed order of summation.
 */

SHARED_ float run_weights[GROUP];
SHARED_ int run_chosen[GROUP];
SHARED_ ivec2 chosen_ones[RAYS]; /* candidates that get a ray, and the number of rays that it stands for */

const int RUN = CANDIDATE_COUNT / GROUP;

struct Candidate {
  vec3 radiance; /* divided by its density: 0 where texels are denser */
  float weight;
  vec3 direction;
  vec3 normal;
  float distance;
};

Candidate candidate(vec3 origin, uvec3 key, int index)
{
  Candidate result;
  vec2 place = sample_r2(key, index);
  float jitter = sample_r2(key + uvec3(1u, 0u, 0u), index).x;
  EmitterSample emitter = sample_emitter(vec3(place, (float(index) + jitter) / float(CANDIDATE_COUNT)), origin);
  vec3 offset = emitter.point - origin;
  float squared = max(dot(offset, offset), 1.0e-20);
  result.distance = sqrt(squared);
  result.direction = offset / result.distance;
  result.normal = emitter.normal;
  float density = point_density(emitter.density, squared, max(abs(dot(result.direction, emitter.normal)), 1.0e-4));
  ivec2 texel = direction_texel(result.direction);
  bool in_texels = density * element(texel_weights, (texel.y % FACE) * FACE + texel.x).x < 1.0;
  result.radiance = in_texels ? vec3(0.0) : emitter.radiance / density;
  result.weight = result.radiance.r + result.radiance.g + result.radiance.b;
  return result;
}

/* Lists in chosen_ones the candidates of a probe at `origin` that get a ray, and returns how many there are; `step` is
 * the weight that each ray stands for. All threads of the group must call it. */
int choose_candidates(vec3 origin, uvec3 key, int lane, out float step)
{
  float weights[RUN], run_weight = 0.0;
  int rays[RUN];
  for (int i = 0; i < RUN; i++) {
    weights[i] = candidate(origin, key, lane * RUN + i).weight;
    rays[i] = 0;
    run_weight += weights[i];
  }
  run_weights[lane] = run_weight;
  barrier();
  float before = 0.0, total = 0.0;
  for (int i = 0; i < GROUP; i++) {
    before += i < lane ? run_weights[i] : 0.0;
    total += run_weights[i];
  }
  step = total / float(RAYS);
  int chosen = 0;
  for (int i = 0; i < RUN && total > 0.0; i++) {
    float after = before + weights[i];
    rays[i] = int(floor(after / step + 0.5) - floor(before / step + 0.5));
    chosen += rays[i] > 0 ? 1 : 0;
    before = after;
  }
  run_chosen[lane] = chosen;
  barrier();
  int place = 0, chosen_count = 0;
  for (int i = 0; i < GROUP; i++) {
    place += i < lane ? run_chosen[i] : 0;
    chosen_count += run_chosen[i];
  }
  for (int i = 0; i < RUN; i++) {
    if (rays[i] > 0 && place < RAYS) {
      chosen_ones[place++] = ivec2(lane * RUN + i, rays[i]);
    }
  }
  barrier();
  return min(chosen_count, RAYS);
}

/* What the probe at `origin` gets of a candidate that got `rays` rays of `step` each, added to its coefficients, and
 * how that changes where the probe moves, to `gradient`: by coefficient along x, then y, then z. */
void add_candidate(inout vec3 sum[COEFFICIENTS], inout vec3 gradient[3 * GRADIENT_COEFFICIENTS], vec3 origin,
                   Candidate chosen, int rays, float step)
{
  vec3 arriving = light_along(origin, chosen.direction, chosen.distance * 0.9999, 0);
  if (arriving == vec3(0.0)) {
    return;
  }
  float basis[COEFFICIENTS];
  vec3 flux = chosen.radiance * (float(rays) * step / chosen.weight) * arriving;
  sh_basis(chosen.direction, basis);
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] += flux * basis[c];
  }
  float cosine = dot(chosen.direction, chosen.normal);
  vec3 turn = 3.0 * chosen.direction -
              chosen.normal / (max(abs(cosine), LEAST_COSINE) * (cosine < 0.0 ? -1.0 : 1.0));
  flux /= max(chosen.distance, nearest);
  vec3 basis_gradient[GRADIENT_COEFFICIENTS];
  sh_basis_gradient(chosen.direction, basis, basis_gradient);
  for (int c = 0; c < GRADIENT_COEFFICIENTS; c++) {
    vec3 change = basis[c] * turn - basis_gradient[c];
    gradient[c] += flux * change.x;
    gradient[GRADIENT_COEFFICIENTS + c] += flux * change.y;
    gradient[2 * GRADIENT_COEFFICIENTS + c] += flux * change.z;
  }
}

/* Adds what the threads of the group have found and stores it. All of them must call it. */
void store_sums(vec3 sum[COEFFICIENTS], vec3 gradient[3 * GRADIENT_COEFFICIENTS], int slot_index, int lane)
{
  for (int c = 0; c < COEFFICIENTS; c++) {
    partial_sums[c * GROUP + lane] = vec4(sum[c], 0.0);
  }
  barrier();
  for (int c = lane; c < COEFFICIENTS; c += GROUP) {
    imageStore(emitted, element_position(slot_index * COEFFICIENTS + c), vec4(group_sum(c), 0.0));
  }
  for (int axis = 0; axis < 3; axis++) {
    barrier();
    for (int c = 0; c < GRADIENT_COEFFICIENTS; c++) {
      partial_sums[c * GROUP + lane] = vec4(gradient[axis * GRADIENT_COEFFICIENTS + c], 0.0);
    }
    barrier();
    for (int c = lane; c < GRADIENT_COEFFICIENTS; c += GROUP) {
      ivec2 target = element_position((slot_index * 3 + axis) * GRADIENT_COEFFICIENTS + c);
      imageStore(emitted_gradient, target, vec4(group_sum(c), 0.0));
    }
  }
}

void main()
{
  int lane = int(gl_LocalInvocationID.x);
  int layer = int(element(probe_layers, int(gl_WorkGroupID.x)).x);
  int slot_index = first_slot + layer;
  vec4 slot = element(probe_slots, slot_index);
  vec3 sum[COEFFICIENTS];
  vec3 gradient[3 * GRADIENT_COEFFICIENTS];
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] = vec3(0.0);
  }
  for (int i = 0; i < 3 * GRADIENT_COEFFICIENTS; i++) {
    gradient[i] = vec3(0.0);
  }
  for (int i = lane; i < 6 * FACE * FACE; i += GROUP) {
    ivec3 at = ivec3(i % FACE, i / FACE, layer);
    vec3 radiance = texel_emitter(at);
    if (radiance != vec3(0.0)) {
      add_texel(sum, at, radiance);
    }
  }
  uvec3 key = uvec3(uint(slot.w), 0xB5297A4Du, uint(seed));
  float step;
  int chosen_count = choose_candidates(slot.xyz, key, lane, step);
  /* the nearest lamp may get all rays, and few threads have it in their runs */
  for (int i = lane; i < chosen_count; i += GROUP) {
    ivec2 chosen = chosen_ones[i];
    add_candidate(sum, gradient, slot.xyz, candidate(slot.xyz, key, chosen.x), chosen.y, step);
  }
  store_sums(sum, gradient, slot_index, lane);
}
