/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How unevenly lamps and sampled emitters light the points of each patch if nothing stands between: what decides how
 * many of them get shadow rays.
 *
 * Some points tell it well enough (core/patches.py: spread_points). Points on emitters are random themselves, but a
 * sample's candidates average that (emitter_lib.glsl): two at each place tell the two variances apart.
 * Dispatch: LANES threads a patch from first_patch on, which share its points; groups of 64. Writes mean and standard
 * deviation of the luminance of one sample's irradiance.
 */

/* Drivers that unroll its loops compile this for twice as long, and run it no faster. */
#pragma optionNV(unroll none)

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

/* `share`: by which the light of this side counts. Adds to `variance` what candidates differ by. */
float luminance_of_side(vec3 point, vec3 normal, uvec3 key, int index, float share, inout float variance)
{
  float luminance = share * dot(lamps_unshadowed(point, normal, key, index), LUMINANCE);
#ifdef HAS_EMITTERS
  float one = share * dot(emitter_unshadowed(point, normal, key, 2 * index), LUMINANCE);
  float other = share * dot(emitter_unshadowed(point, normal, key, 2 * index + 1), LUMINANCE);
  luminance += 0.5 * (one + other);
  vec3 near = emitter_direction_irradiance(leave_surface(point, normal), normal, key, index);
  luminance += share * dot(near, LUMINANCE);
  variance += 0.5 * (one - other) * (one - other) / float(point_count);
#endif
  return luminance;
}

#if LANES > 1
SHARED_ vec3 shares[64];
#endif

/* Over a lane's points: of luminances, of their squares, of what candidates differ by. */
vec3 sums_of_points(int patch_index, int lane)
{
  uvec3 key = uvec3(uint(patch_index), 0u, uint(seed));
#ifdef HAS_LINKS
  lit_role = role_of_sheet(int(element(sheet_numbers, patch_index).x));
#endif
  float sum = 0.0, squares = 0.0, candidate_variance = 0.0;
  for (int i = lane; i < point_count; i += LANES) {
    vec4 at = element(patch_points, POINTS * patch_index + POINTS / point_count * i);
    vec3 normal = unpack_normal(at.w);
#ifdef HAS_SHEETS
    float through = dot(share_of_back(int(element(sheet_numbers, patch_index).x)), LUMINANCE);
    float luminance = luminance_of_side(at.xyz, normal, key, i, 1.0 - through, candidate_variance);
    if (through > 0.0) {
      luminance += luminance_of_side(at.xyz, -normal, key + uvec3(0u, BACK_STREAM, 0u), i, through, candidate_variance);
    }
#else
    float luminance = luminance_of_side(at.xyz, normal, key, i, 1.0, candidate_variance);
#endif
    sum += luminance;
    squares += luminance * luminance;
  }
  return vec3(sum, squares, candidate_variance);
}

void main()
{
  int entry = LINEAR_THREAD / LANES;
  int patch_index = first_patch + entry;
  vec3 sums = entry < patch_count ? sums_of_points(patch_index, LINEAR_THREAD % LANES) : vec3(0.0);
#if LANES > 1
  int thread_index = int(gl_LocalInvocationID.x);
  shares[thread_index] = sums;
  barrier();
  for (int lane = 1; lane < LANES && thread_index % LANES == 0; lane++) {
    sums += shares[thread_index + lane];
  }
  if (thread_index % LANES != 0) {
    return;
  }
#endif
  if (entry >= patch_count) {
    return;
  }
  float mean = sums.x / float(point_count);
  float variance = max(sums.y / float(point_count) - mean * mean - 0.5 * sums.z, 0.0);
#ifdef HAS_EMITTERS
  variance += sums.z / float(CANDIDATES);
#endif
  imageStore(spread, element_position(patch_index), vec4(mean, sqrt(variance), 0.0, 0.0));
}
