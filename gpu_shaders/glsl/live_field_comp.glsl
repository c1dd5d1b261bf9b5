/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Leads the field that pictures show to what probes have by now: a share of the way for coefficients and gradients of
 * all slots.
 *
 * target_field, COEFFICIENTS elements a slot; steepness: what live_steepness_comp wrote; target_gradient: as
 * live_gradient_lib reads it, not limited. field and gradient: as field_lib reads them, by node, over one cell along
 * the grid's axes.
 * Dispatch: one thread a coefficient of a slot; groups of 64. Twin: core/gradients.py, limited.
 */

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
  vec3 kept = element(steepness, slot).xyz;
  vec3 change = vec3(0.0);
  for (int axis = 0; axis < 3; axis++) {
    change += kept[axis] * abs(gradient_over_cell(slot, axis, 0));
  }
  vec3 most = MOST_CHANGE * abs(element(target_field, slot * COEFFICIENTS).rgb);
  vec3 scale = mix(vec3(1.0), most / max(change, vec3(1.0e-30)), greaterThan(change, most));
  for (int axis = 0; axis < 3; axis++) {
    at = element_position((node * 3 + axis) * TRANSFER_COEFFICIENTS + index);
    vec4 wanted = vec4(kept[axis] * scale * gradient_over_cell(slot, axis, index), 0.0);
    imageStore(gradient, at, mix(imageLoad(gradient, at), wanted, share));
  }
}
