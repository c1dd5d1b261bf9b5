/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How far iterations are apart: sums over the patches that probes see, of the last three irradiances.
 *
 * Dispatch: groups of THREADS, each a share of the patches; fixed order of summation. Writes three elements a group,
 * from `result` on: |new|², |new − old|², (new − old)·(old − older), luminance, all of irradiance times a scale, so
 * that squares of 1e-30 and of 1e30 both fit | number of patches, of slow patches, |new|² and |what is still to come|²
 * of the others | that scale.
 */

const int AT_ONCE = 4; /* patches of a thread that are on their way from memory together */

SHARED_ vec4 partial_sums[THREADS];

/* In the first lane; all must call it. */
vec4 sum_of_group(vec4 mine, int lane)
{
  barrier();
  partial_sums[lane] = mine;
  barrier();
  for (int half_count = THREADS / 2; half_count > 0; half_count /= 2) {
    if (lane < half_count) {
      partial_sums[lane] += partial_sums[lane + half_count];
    }
    barrier();
  }
  return partial_sums[0];
}

void main()
{
  int lane = int(gl_LocalInvocationID.x);
  int group = int(gl_WorkGroupID.x);
  int stride = AT_ONCE * THREADS * int(gl_NumWorkGroups.x);
  float unit = element(brightest, 0).x;
  float scale = unit > 1.0e-37 && unit < 1.0e37 ? 1.0 / unit : 1.0; /* light that is not finite is found by its sums */
  vec4 sum = vec4(0.0), others = vec4(0.0);
  for (int first = AT_ONCE * THREADS * group + lane; first < patch_count; first += stride) {
    for (int k = 0; k < AT_ONCE; k++) {
      int i = min(first + k * THREADS, patch_count - 1);
      vec3 fresh = element(irradiance_new, i).rgb * scale;
      vec3 old = element(irradiance_old, i).rgb * scale;
      vec3 change = fresh - old;
      vec3 last_change = old - element(irradiance_older, i).rgb * scale;
      float weight = first + k * THREADS < patch_count ? max(element(patch_seen, i).x, unseen) : 0.0;
      float open = is_slow(fresh, change, last_change) ? 0.0 : weight;
      others += vec4(weight, weight - open, open * dot(fresh, fresh), open * tail_squared(change, last_change));
      sum += weight * vec4(dot(fresh, fresh), dot(change, change), dot(change, last_change),
                           dot(fresh, vec3(0.2126, 0.7152, 0.0722)));
    }
  }
  sum = sum_of_group(sum, lane);
  others = sum_of_group(others, lane);
  if (lane == 0) {
    imageStore(change, element_position(result + 3 * group), sum);
    imageStore(change, element_position(result + 3 * group + 1), others);
    imageStore(change, element_position(result + 3 * group + 2), vec4(scale, 0.0, 0.0, 0.0));
  }
}
