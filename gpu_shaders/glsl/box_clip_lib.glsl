/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rays against the boxes around what changed. Reference: core/change_reach.py. */

/* From where to where (t ≥ 0) the way origin + t·direction runs inside the box; nowhere if x > y. */
vec2 clip_to_box(vec3 low, vec3 high, vec3 origin, vec3 direction)
{
  vec3 safe = mix(direction, vec3(1.0e-20), lessThan(abs(direction), vec3(1.0e-20)));
  vec3 to_low = (low - origin) / safe;
  vec3 to_high = (high - origin) / safe;
  vec3 enter = min(to_low, to_high);
  vec3 leave = max(to_low, to_high);
  return vec2(max(max(enter.x, enter.y), max(enter.z, 0.0)), min(leave.x, min(leave.y, leave.z)));
}
