/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Light of nodes without light of their own: one sweep towards the mean of their neighbours, as core/dilation.py does
 * many.
 *
 * fill_nodes, 2 elements a node: neighbours along the axes, −1 past the edge (0..5), the node itself (6)
 * Dispatch: one thread a coefficient of such a node; groups of 64. Neighbours may be of this sweep or the one before.
 */

void main()
{
  int i = LINEAR_THREAD;
  if (i >= node_count * COEFFICIENTS) {
    return;
  }
  int entry = i / COEFFICIENTS;
  int index = i - entry * COEFFICIENTS;
  vec4 first = element(fill_nodes, 2 * entry);
  vec4 second = element(fill_nodes, 2 * entry + 1);
  float neighbours[6] = float[6](first.x, first.y, first.z, first.w, second.x, second.y);
  vec4 sum = vec4(0.0);
  float count = 0.0;
  for (int side = 0; side < 6; side++) {
    if (neighbours[side] >= 0.0) {
      sum += imageLoad(field, element_position(int(neighbours[side]) * COEFFICIENTS + index));
      count += 1.0;
    }
  }
  if (count > 0.0) {
    imageStore(field, element_position(int(second.z) * COEFFICIENTS + index), sum / count);
  }
}
