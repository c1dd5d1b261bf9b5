/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Key of the cell that each hit lies in, see patch_cell_lib; and which hits ask for a patch.
 *
 * Dispatch: one thread a hit; groups of 64. With HAS_VIEW the hits are texels of probes from first_slot on, TEXELS
 * each, and near ones get finer cells. With only_lost, hits ask that have none after a search. cell_rule: three rows of
 * the matrix to the volume's box, half its edge in w; edge of plain cells, the finest cells against it, shift of cells,
 * angle; the box's middle.
 */

/* Number 0 … 26 of the one among 26 directions (axes, edges and corners of a cube) that is nearest to a packed
 * normal. */
float facing(float packed_normal)
{
  float high = floor(packed_normal / 4096.0);
  vec2 uv = (vec2(packed_normal - 4096.0 * high, high) - 2048.0) / NORMAL_STEPS;
  float z = 1.0 - abs(uv.x) - abs(uv.y);
  float fold = max(-z, 0.0);
  vec3 normal = vec3(uv.x - (uv.x < 0.0 ? -fold : fold), uv.y - (uv.y < 0.0 ? -fold : fold), z);
  float most = max(abs(normal.x), max(abs(normal.y), abs(normal.z)));
  return dot(roundEven(normal / most), vec3(9.0, 3.0, 1.0)) + 13.0;
}

void main()
{
  int hit = LINEAR_THREAD;
  if (hit >= hit_count) {
    return;
  }
  vec4 at = element(hits, hit);
  float before = only_lost != 0 ? imageLoad(bound, element_position(hit)).x : NO_PATCH;
  float state = at.w < 0.0 ? without_surface : before == NO_PATCH ? PENDING : before;
  imageStore(bound, element_position(hit), vec4(state));
  if (state != PENDING) {
    return;
  }
  vec4 rule = element(cell_rule, 3);
  float edge = rule.x, angle = rule.w;
  vec3 from_middle = at.xyz - element(cell_rule, 4).xyz;
  vec3 beyond;
  for (int axis = 0; axis < 3; axis++) {
    vec4 row = element(cell_rule, axis);
    beyond[axis] = max(abs(dot(row.xyz, from_middle)) - 1.0, 0.0) * row.w;
  }
  float wanted = max(0.5 * angle / edge * length(beyond), 1.0);
#ifdef HAS_VIEW
  float view = distance(at.xyz, element(probe_slots, first_slot + hit / TEXELS).xyz);
  wanted = max(min(wanted, angle / edge * view), rule.y);
#endif
  int level = (floatBitsToInt(wanted) >> 23) - 127 + coarser; /* ⌊log2⌋ */
  vec3 place = floor(at.xyz * ldexp(1.0 / edge, -level) + rule.z);
  float number = float((level + 16) * 27) + facing(at.w);
#ifdef HAS_SHEETS
  number += LEVELS_AND_FACINGS * element(hit_sheets, hit).x;
#endif
  imageStore(hit_keys, element_position(hit), vec4(place, number));
}
