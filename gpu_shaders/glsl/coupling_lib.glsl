/* SPDX-License-Identifier: GPL-3.0-or-later */
/* By how much more, or less, light counts that arrives at grazing angles where gloss is sent in all directions:
 * core/faint_gloss.py. */

vec4 coupling = vec4(0.0, 0.0, 0.0, 1.0); /* of the surface that is being lit, said before light is asked for */

vec3 coupled(float cosine)
{
  float grazing = pow(clamp(1.0 - cosine, 0.0, 1.0), coupling.w) - 2.0 / ((coupling.w + 1.0) * (coupling.w + 2.0));
  return 1.0 + coupling.rgb * grazing;
}
