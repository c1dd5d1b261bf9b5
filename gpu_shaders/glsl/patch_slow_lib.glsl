/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Patches whose light is slow to settle, and how much of the others' is still to come, by the last changes of their
 * irradiance.
 *
 * Reference: core/patches.py, is_slow. Needs `tolerance` and SLOW.
 */

/* |what is still to come|² of a patch, by its last two changes, if it comes within the bounces that anybody waits
 * for. */
float tail_squared(vec3 change, vec3 last_change)
{
  float ratio = min(sqrt(dot(change, change) / max(dot(last_change, last_change), 1.0e-37)), SLOW);
  return dot(change, change) * ratio * ratio / ((1.0 - ratio) * (1.0 - ratio));
}

/* Patches in hollows: light comes and goes so slowly that each bounce changes it by nearly as much as the one before,
 * and as many bounces as that takes would change it by more than the tolerance. */
bool is_slow(vec3 fresh, vec3 change, vec3 last_change)
{
  float bounces = 1.0 / (1.0 - SLOW);
  return dot(change, change) > SLOW * SLOW * dot(last_change, last_change) &&
         bounces * bounces * dot(change, change) > tolerance * tolerance * dot(fresh, fresh);
}
