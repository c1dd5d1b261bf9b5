/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Sheets let light through diffusely; what a patch on one shows is the light of both of its sides. Reference and
 * reasons: core/sheets.py.
 *
 * sheets, 1 element a sheet: share of the light of the back, and with HAS_LINKS the role of its surface in light
 * linking. Number 0 is no sheet and lets nothing through; others may let nothing through as well, and are told apart by
 * their role.
 */

const uint BACK_STREAM = 0x51ED2705u, SIDE_STREAM = 0x6C8E9CF5u;

/* Number of the sheet that a triangle is part of. */
int sheet_of_triangle(int triangle)
{
  return int(element(triangle_corners, 3 * triangle + 2).w);
}

vec3 share_of_back(int sheet)
{
  return sheet > 0 ? element(sheets, sheet).rgb : vec3(0.0);
}

#ifdef HAS_LINKS
int role_of_sheet(int sheet)
{
  return int(element(sheets, sheet).w);
}
#endif

/* Weight of a ray from a place of which every second one leaves from the back. */
vec3 side_weight(vec3 through, bool crosses)
{
  return through == vec3(0.0) ? vec3(1.0) : 2.0 * (crosses ? through : 1.0 - through);
}
