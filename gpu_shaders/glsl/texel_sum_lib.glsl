/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What one thread adds to its share of a probe's coefficients: light of texels, by their part of the sphere. */

void add_texel(inout vec3 sum[COEFFICIENTS], ivec3 at, vec3 radiance)
{
  float basis[COEFFICIENTS];
  sh_basis(texel_direction(at.xy), basis);
  radiance *= element(texel_weights, (at.y % FACE) * FACE + at.x).x;
  for (int c = 0; c < COEFFICIENTS; c++) {
    sum[c] += radiance * basis[c];
  }
}
