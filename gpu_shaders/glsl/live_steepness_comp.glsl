/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How much of its gradient along each axis of the grid a probe may keep: no more than STEEPEST times what it and a
 * neighbour differ by, the larger of both.
 *
 * slot_neighbours, 2 elements a slot: slots of active neighbours, before and behind along each axis, −1 where there is
 * none; target_field, COEFFICIENTS elements a slot. Writes steepness, 1 element a slot: shares along the three axes.
 * Dispatch: one thread a slot; groups of 64. Twin: core/gradients.py, steepness.
 */

/* A_l of coefficient `index`: radiance to irradiance. */
float cosine_lobe(int index)
{
  return index == 0 ? 3.141592653589793 : (index < 4 ? 2.0943951023931953 : 0.7853981633974483);
}

void main()
{
  int slot = LINEAR_THREAD;
  if (slot >= slot_count) {
    return;
  }
  vec4 first = element(slot_neighbours, 2 * slot);
  vec4 second = element(slot_neighbours, 2 * slot + 1);
  float beside[6] = float[6](first.x, first.y, first.z, first.w, second.x, second.y);
  vec4 result = vec4(1.0);
  for (int axis = 0; axis < 3; axis++) {
    float slope = 0.0, before = -1.0, behind = -1.0;
    int one = int(beside[2 * axis]), other = int(beside[2 * axis + 1]);
    for (int i = 0; i < TRANSFER_COEFFICIENTS; i++) {
      float lobe = cosine_lobe(i);
      vec3 own = element(target_field, slot * COEFFICIENTS + i).rgb;
      vec3 change = lobe * gradient_over_cell(slot, axis, i);
      slope += dot(change, change);
      if (one >= 0) {
        vec3 apart = lobe * (element(target_field, one * COEFFICIENTS + i).rgb - own);
        before = max(before, 0.0) + dot(apart, apart);
      }
      if (other >= 0) {
        vec3 apart = lobe * (element(target_field, other * COEFFICIENTS + i).rgb - own);
        behind = max(behind, 0.0) + dot(apart, apart);
      }
    }
    float most = max(before, behind);
    if (most >= 0.0 && slope > STEEPEST * STEEPEST * most) {
      result[axis] = STEEPEST * sqrt(most / slope);
    }
  }
  imageStore(steepness, element_position(slot), result);
}
