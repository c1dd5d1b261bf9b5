/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Real orthonormal spherical harmonics without the Condon-Shortley phase, order l(l+1)+m.
 * Sloan, "Stupid Spherical Harmonics (SH) Tricks", 2008, A2. Reference: core/spherical_harmonics.py.
 * BANDS is 1 to 4, COEFFICIENTS = BANDS².
 */

void sh_basis(vec3 d, out float y[COEFFICIENTS])
{
  y[0] = 0.28209479177387814;
#if BANDS > 1
  y[1] = 0.4886025119029199 * d.y;
  y[2] = 0.4886025119029199 * d.z;
  y[3] = 0.4886025119029199 * d.x;
#endif
#if BANDS > 2
  y[4] = 1.0925484305920792 * d.x * d.y;
  y[5] = 1.0925484305920792 * d.y * d.z;
  y[6] = 0.31539156525252005 * (3.0 * d.z * d.z - 1.0);
  y[7] = 1.0925484305920792 * d.x * d.z;
  y[8] = 0.5462742152960396 * (d.x * d.x - d.y * d.y);
#endif
#if BANDS > 3
  y[9] = 0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y);
  y[10] = 2.890611442640554 * d.x * d.y * d.z;
  y[11] = 0.4570457994644658 * d.y * (5.0 * d.z * d.z - 1.0);
  y[12] = 0.3731763325901154 * d.z * (5.0 * d.z * d.z - 3.0);
  y[13] = 0.4570457994644658 * d.x * (5.0 * d.z * d.z - 1.0);
  y[14] = 1.445305721320277 * d.z * (d.x * d.x - d.y * d.y);
  y[15] = 0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y);
#endif
}

/* Clamped-cosine transfer A_l Y_lm(n) (Ramamoorthi and Hanrahan 2001, eq. 8). The fourth band's factor is zero, so
 * lookups of irradiance read at most nine coefficients. */
const int TRANSFER_COEFFICIENTS = COEFFICIENTS < 9 ? COEFFICIENTS : 9;

void sh_cosine_transfer(vec3 n, out float transfer[COEFFICIENTS])
{
  sh_basis(n, transfer);
  for (int i = 0; i < COEFFICIENTS; i++) {
    transfer[i] *= i == 0 ? 3.141592653589793 : i < 4 ? 2.0943951023931953 : i < 9 ? 0.7853981633974483 : 0.0;
  }
}
