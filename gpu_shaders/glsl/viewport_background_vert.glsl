/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The world behind the scene, vertex stage: one triangle over the whole view, at its far end.
 *
 * Draw: 3 vertices.
 */

void main()
{
  place = corner;
  gl_Position = vec4(corner, 1.0, 1.0);
}
