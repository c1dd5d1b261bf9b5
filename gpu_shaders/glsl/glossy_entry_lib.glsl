/* SPDX-License-Identifier: GPL-3.0-or-later */
/* A texel that shows a glossy surface, as the shaders know it that ask what it mirrors.
 *
 * glossy: the texels, (probe · 6·FACE + row) · FACE + column, probes from first_layer on.
 */

const uint PLACE_STREAM = 0x2C1B3C6Du;

struct GlossyEntry {
  int texel; /* as in `glossy` */
  int number; /* of the probe's texels */
  ivec3 at;
  vec3 origin; /* of the probe */
  Gloss gloss;
  Way middle;
  float width; /* of the lobe: so wide that places in the texel do not miss a lamp between them */
  uvec3 key, light_key, place_key;
};

GlossyEntry glossy_entry(int entry)
{
  GlossyEntry glossy_at;
  glossy_at.texel = int(element(glossy, entry).x);
  int probe = glossy_at.texel / (6 * FACE * FACE);
  glossy_at.number = glossy_at.texel - probe * 6 * FACE * FACE;
  ivec2 place = ivec2(glossy_at.number % FACE, glossy_at.number / FACE);
  glossy_at.at = ivec3(place, first_layer + probe);
  vec4 seen = texelFetch(geometry, glossy_at.at, 0), slot = element(probe_slots, first_slot + probe);
  int triangle = int(seen.w);
  vec3 direction = texel_direction(place);
  glossy_at.origin = slot.xyz;
  glossy_at.gloss = gloss_of(triangle);
  glossy_at.middle = met_in_middle(triangle, abs(seen.z), slot.xyz, direction);
  glossy_at.middle.surface.albedo *= passed_to(slot.xyz, direction, abs(seen.z) * 0.9999);
  glossy_at.width = blurred(glossy_at.gloss.alpha, TEXEL_BLUR * turn_over(glossy_at.middle, slot.xyz, place));
  glossy_at.key = uvec3(uint(slot.w), 0x165667B1u, uint(seed));
  glossy_at.light_key = glossy_at.key + uvec3(0u, LIGHT_STREAM, 0u);
  glossy_at.place_key = glossy_at.key + uvec3(0u, PLACE_STREAM, 0u);
  return glossy_at;
}

/* The place in the texel that ray `number` leaves from, if nothing hides it. */
Way ray_place(GlossyEntry glossy_at, int ray_number)
{
  vec2 place = sample_r3(glossy_at.place_key + uvec3(0u, 0u, 1u), ray_number).xy;
  return way_through(place, glossy_at.middle, glossy_at.origin, glossy_at.at.xy);
}
