/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Leads the field that pictures show to what probes have by now: a share of the way for coefficients and gradients of
 * all slots.
 *
 * target_field, COEFFICIENTS elements a slot; target_gradient, 3 · TRANSFER_COEFFICIENTS elements a slot, per metre
 * along the world's axes, not limited. field and gradient: as field_lib reads them, by node, over one cell along the
 * grid's axes.
 * cell_info, 3 elements: one cell along each axis of the grid, metres; 0 where it has no cell
 * Dispatch: one thread a coefficient of a slot; groups of 64. Twins: core/gradients.py, per_cell and limited.
 */

vec3 gradient_over_cell(int slot, int axis, int index)
{
  vec3 cell = cell_info[axis].xyz;
  vec3 sum = vec3(0.0);
  for (int world = 0; world < 3; world++) {
    sum += cell[world] * element(target_gradient, (slot * 3 + world) * TRANSFER_COEFFICIENTS + index).rgb;
  }
  return sum;
}

void main()
{
  int i = LINEAR_THREAD;
  if (i >= slot_count * COEFFICIENTS) {
    return;
  }
  int slot = i / COEFFICIENTS;
  int index = i - slot * COEFFICIENTS;
  int node = int(element(probe_slots, slot).w);
  ivec2 at = element_position(node * COEFFICIENTS + index);
  imageStore(field, at, mix(imageLoad(field, at), element(target_field, i), share));
  if (index >= TRANSFER_COEFFICIENTS) {
    return;
  }
  vec3 change = vec3(0.0);
  for (int axis = 0; axis < 3; axis++) {
    change += abs(gradient_over_cell(slot, axis, 0));
  }
  vec3 most = MOST_CHANGE * abs(element(target_field, slot * COEFFICIENTS).rgb);
  vec3 scale = mix(vec3(1.0), most / max(change, vec3(1.0e-30)), greaterThan(change, most));
  for (int axis = 0; axis < 3; axis++) {
    at = element_position((node * 3 + axis) * TRANSFER_COEFFICIENTS + index);
    vec4 wanted = vec4(gradient_over_cell(slot, axis, index) * scale, 0.0);
    imageStore(gradient, at, mix(imageLoad(gradient, at), wanted, share));
  }
}
