/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Gradients as probes have them by now: `target_gradient`, 3 · TRANSFER_COEFFICIENTS elements a slot, per metre along
 * the world's axes; `cell_info`, 3 elements: one cell along each axis of the grid, metres, 0 where it has no cell.
 * Twin: core/gradients.py, per_cell.
 */

/* Change of coefficient `index` over one cell along `axis` of the grid. */
vec3 gradient_over_cell(int slot, int axis, int index)
{
  vec3 cell = cell_info[axis].xyz;
  vec3 sum = vec3(0.0);
  for (int world = 0; world < 3; world++) {
    sum += cell[world] * element(target_gradient, (slot * 3 + world) * TRANSFER_COEFFICIENTS + index).rgb;
  }
  return sum;
}
