/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The finished view, vertex stage: one triangle over the whole region.
 *
 * Draw: 3 vertices.
 */

void main()
{
  place = corner * 0.5 + 0.5;
  gl_Position = vec4(corner, 0.0, 1.0);
}
