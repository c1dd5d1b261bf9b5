/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Lines of sight between hits and leaders of patches (position, packed normal). Both ends are raised off the surface,
 * so that a curved one does not hide its own parts; obstacles lower than that do not count. */

const float RAISE = 0.15; /* of the distance between the two */

bool sees(vec4 hit, vec4 leader)
{
  float apart = distance(hit.xyz, leader.xyz);
  vec3 from = leave_surface(hit.xyz, unpack_normal(hit.w)) + unpack_normal(hit.w) * (RAISE * apart);
  vec3 to = leave_surface(leader.xyz, unpack_normal(leader.w)) + unpack_normal(leader.w) * (RAISE * apart);
  float range = distance(from, to);
  return range <= 0.0 || !trace_any(from, (to - from) / range, range);
}
