/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Six elements a direction: octahedral coordinates and their inverse; its texel and that texel's direction; 16 SH
 * functions. */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    vec3 direction = element(directions, i).xyz;
    vec2 uv = octahedral_encode(direction);
    ivec2 texel = direction_texel(direction);
    float y[COEFFICIENTS];
    sh_basis(direction, y);
    imageStore(result, element_position(8 * i), vec4(uv, texel));
    imageStore(result, element_position(8 * i + 1), vec4(octahedral_decode(uv), 0.0));
    imageStore(result, element_position(8 * i + 2), vec4(texel_direction(texel), 0.0));
    for (int j = 0; j < 4; j++) {
      imageStore(result, element_position(8 * i + 3 + j), vec4(y[4 * j], y[4 * j + 1], y[4 * j + 2], y[4 * j + 3]));
    }
  }
}
