/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How far secondary rays start off the surfaces that they leave: by what rounding may have moved the point, no more. */

const float STEP = 3.8e-6; /* of a point's magnitude: how far secondary rays step off a surface */

/* Steps off a surface before a secondary ray starts: the rounding error of a hit point grows with the coordinates and
 * with the distance of the ray that found it, so the step does too. `towards` points back to where that ray came
 * from. */
vec3 step_off(vec3 point, vec3 normal, vec3 towards, float distance)
{
  float magnitude = max(max(abs(point.x), abs(point.y)), max(abs(point.z), distance));
  return point + (normal + towards) * (magnitude * STEP);
}

/* The same for a point of which nothing is known but where it lies: a ray found it from no farther than the scene's
 * middle is twice. */
vec3 leave_surface(vec3 point, vec3 normal)
{
  return step_off(point, normal, normal, 2.0 * length(point));
}

/* A hit point moved back a little to where its ray came from, so that it does not lie beyond the next wall where two
 * meet. */
vec3 pull_back(vec3 point, vec3 direction, float distance)
{
  float magnitude = max(max(abs(point.x), abs(point.y)), max(abs(point.z), distance));
  return point - direction * (magnitude * STEP);
}
