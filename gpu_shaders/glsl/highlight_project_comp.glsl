/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Highlights of lamps in gloss that is not followed, added to the field: texels send what a part of the light does to
 * their patch in lobes instead of evenly. Shadows are those of the patch, so it takes no ray. Reference:
 * core/highlights.py.
 *
 * With HAS_EMITTERS the part is that of sampled emitters, else that of the lamps first_light .. last_light. LOOKS looks
 * a texel, MOST_LOOKS where a lobe is narrow, from places all over it at places all over the lamps, each weighted by
 * what arrives if nothing stands between.
 * part_irradiance: of that part alone, an element a patch; part_spread: see patch_spread_comp
 * probe_layers, 1 element a probe of the dispatch: its layer; its slot is that much after first_slot
 * Dispatch: one group of GROUP threads a probe. Threads take texels in strides.
 */

/* Radiance that a texel sends in highlights beyond what it sends evenly. */
vec3 highlights_of_texel(ivec3 at, vec4 slot)
{
  vec4 reflects = texelFetch(albedo, at, 0);
  vec4 seen = texelFetch(geometry, at, 0);
  int triangle = int(seen.w);
  bool is_lit = reflects.w >= 0.0 && seen.z < NO_SURFACE;
  vec3 irradiance = is_lit ? element(part_irradiance, int(reflects.w)).rgb : vec3(0.0);
  if (irradiance == vec3(0.0)) {
    return vec3(0.0);
  }
  FaintGloss faint = faint_gloss_of(int(element(triangle_attributes, 5 * triangle).w));
  bool is_even = faint.gloss.share == vec3(0.0);
#ifdef HAS_SHEETS
  is_even = is_even || share_of_back(sheet_of_triangle(triangle)) != vec3(0.0);
#endif
  if (is_even) {
    return vec3(0.0);
  }
#ifdef HAS_LINKS
  lit_role = role_of_triangle(triangle);
#endif
  Way middle = met_in_middle(triangle, abs(seen.z), slot.xyz, texel_direction(at.xy));
  int first = 5 * triangle;
  vec3 normal = element(triangle_attributes, first).xyz;
  bool is_flat = normal == element(triangle_attributes, first + 1).xyz &&
                 normal == element(triangle_attributes, first + 2).xyz;
  float turn = is_flat ? 0.7853981633974483 / float(FACE) : turn_over(middle, slot.xyz, at.xy);
  float width = blurred(faint.gloss.alpha, HIGHLIGHT_BLUR * turn);
  uvec3 key = uvec3(uint(slot.w), HIGHLIGHT_STREAM, uint(seed));
  Look look = Look(vec3(0.0), 0.0, turn, false);
  int looks = 0;
  for (; looks < LOOKS || (look.is_sharp && looks < MOST_LOOKS); looks++) {
    int number = (at.y * FACE + at.x) * MOST_LOOKS + looks;
    Way way = way_through(sample_r3(key + uvec3(0u, 1u, 0u), number).xy, middle, slot.xyz, at.xy);
    look_at_part(look, faint, way.surface, -way.direction, width, key, number);
  }
  /* what holes before the surface leave is in the texel's albedo alone */
  vec3 left = reflects.rgb / max(middle.surface.albedo, vec3(1.0e-9));
  return irradiance * left * mean_look(look, looks, element(part_spread, int(reflects.w)).x);
}

void main()
{
  int lane = int(gl_LocalInvocationID.x);
  int layer = int(element(probe_layers, int(gl_WorkGroupID.x)).x);
  vec4 slot = element(probe_slots, first_slot + layer);
  vec3 sum[COEFFICIENTS];
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] = vec3(0.0);
  }
  for (int i = lane; i < 6 * FACE * FACE; i += GROUP) {
    ivec3 at = ivec3(i % FACE, i / FACE, layer);
    vec3 radiance = highlights_of_texel(at, slot);
    if (radiance != vec3(0.0)) {
      add_texel(sum, at, radiance);
    }
  }
  for (int c = 0; c < COEFFICIENTS; c++) {
    partial_sums[c * GROUP + lane] = vec4(sum[c], 0.0);
  }
  barrier();
  for (int c = lane; c < COEFFICIENTS; c += GROUP) {
    ivec2 place = element_position((first_slot + layer) * COEFFICIENTS + c);
    imageStore(field, place, imageLoad(field, place) + vec4(group_sum(c), 0.0));
  }
}
