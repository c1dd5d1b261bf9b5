/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What patches get of highlights of lamps in gloss that is not followed, beyond what such gloss sends them evenly: a
 * part of the light at the patches where their rays end, sent back along the ray in lobes.
 * Reference: core/highlights.py.
 *
 * Directions are those of patch_rays_comp. Adds to `highlights` of each patch.
 * part_irradiance: of that part alone, an element a patch; part_spread: see patch_spread_comp
 * couplings, 2 elements a patch: see place_coupling_comp
 * Dispatch: one thread for each of count patches or texels, from number first_key on; groups of 64.
 */

/* What the end of a ray sends back along it in lobes, beyond what it sends evenly, of its `irradiance`. met: position
 * and packed normal there; made_of: its mean albedo and the number of its gloss. */
vec3 sent_beyond(int ray, int end, vec3 irradiance, vec4 met, vec4 made_of, vec3 direction, uvec3 key, int number)
{
  Surface surface;
  surface.position = met.xyz;
  surface.normal = unpack_normal(met.w);
  surface.mean_albedo = made_of.rgb;
  surface.coupling = element(couplings, 2 * end);
  float leaving = -dot(direction, surface.normal);
  if (leaving <= 0.0) {
    return vec3(0.0);
  }
#ifdef HAS_LINKS
  lit_role = role_of_sheet(int(element(sheet_numbers, end).x));
#endif
  FaintGloss faint = faint_gloss_of(int(made_of.w));
  Look look = Look(vec3(0.0), 0.0, 0.0, false);
  uvec3 light_key = key + uvec3(0u, HIGHLIGHT_STREAM, 0u);
  look_at_part(look, faint, surface, -direction, max(faint.gloss.alpha, PATCH_BLUR), light_key, number);
  vec3 evenly = max(albedo_at(faint, surface.mean_albedo, leaving), vec3(1.0e-9));
  vec3 beyond = mean_look(look, 1, element(part_spread, end).x) * 3.141592653589793;
  return element(reflected, ray).rgb / evenly * irradiance * beyond;
}

void main()
{
  int index = LINEAR_THREAD;
  if (index >= count) {
    return;
  }
  uvec3 key = uvec3(uint(first_key + index), 0x85EBCA6Bu, uint(seed));
  vec3 sum = vec3(0.0);
  int counted = 0;
  for (int number = 0; number < rays_each; number++) {
    int ray = index * rays_each + number;
    int end = int(element(ray_ends, ray).x);
    counted += end != -1 ? 1 : 0;
    if (end < 0) {
      continue;
    }
    vec3 irradiance = element(part_irradiance, end).rgb;
    vec4 made_of = element(couplings, 2 * end + 1);
    if (irradiance == vec3(0.0) || made_of.w < 0.0) {
      continue;
    }
    vec4 at = element(leaving_points, POINTS * index + number * POINTS / rays_each % POINTS);
    vec3 normal = unpack_normal(at.w);
#ifdef HAS_SHEETS
    if (share_of_back(int(element(sheet_numbers, end).x)) != vec3(0.0)) {
      continue;
    }
    if (share_of_back(int(element(leaving_sheets, index).x)) != vec3(0.0) && (number & 1) != 0) {
      normal = -normal;
    }
#endif
    vec3 direction = sample_cosine(normal, sample_r2(key, number));
    vec4 met = element(patch_points, PATCH_POINTS * end + ray % PATCH_POINTS);
#ifdef HAS_MIRRORS
    if (dot(normalize(met.xyz - at.xyz), direction) < 0.7) {
      continue; /* mirrored on the way */
    }
#endif
    sum += sent_beyond(ray, end, irradiance, met, made_of, direction, key, number);
  }
  ivec2 place = element_position(index);
  imageStore(highlights, place, imageLoad(highlights, place) + vec4(sum / float(max(counted, 1)), 0.0));
}
