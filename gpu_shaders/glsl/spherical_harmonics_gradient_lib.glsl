/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Gradients on the sphere of the basis functions that irradiance needs, GRADIENT_COEFFICIENTS of them, perpendicular to
 * the direction: those of the polynomials less their part along it. Reference: core/spherical_harmonics.py.
 */

void sh_basis_gradient(vec3 d, float y[COEFFICIENTS], out vec3 gradient[GRADIENT_COEFFICIENTS])
{
  gradient[0] = vec3(0.0);
#if GRADIENT_COEFFICIENTS > 1
  gradient[1] = vec3(0.0, 0.4886025119029199, 0.0);
  gradient[2] = vec3(0.0, 0.0, 0.4886025119029199);
  gradient[3] = vec3(0.4886025119029199, 0.0, 0.0);
#endif
#if GRADIENT_COEFFICIENTS > 4
  gradient[4] = 1.0925484305920792 * vec3(d.y, d.x, 0.0);
  gradient[5] = 1.0925484305920792 * vec3(0.0, d.z, d.y);
  gradient[6] = 0.31539156525252005 * vec3(-2.0 * d.x, -2.0 * d.y, 4.0 * d.z);
  gradient[7] = 1.0925484305920792 * vec3(d.z, 0.0, d.x);
  gradient[8] = 1.0925484305920792 * vec3(d.x, -d.y, 0.0);
#endif
  for (int i = 1; i < GRADIENT_COEFFICIENTS; i++) {
    gradient[i] -= d * (y[i] * (i < 4 ? 1.0 : 2.0));
  }
}
