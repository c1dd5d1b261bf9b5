/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Cubemap texels. Reference: core/cubemap.py; the faces are drawn in core/conventions.py.
 *
 * The surfaces of a probe are one layer, FACE wide and 6·FACE high: x = column, y = face·FACE + row.
 */

/* from the cube's frame to the world; why: core/conventions.py */
const mat3 CUBE_TURN = mat3(72.0, 48.0, -46.0, -24.0, 82.0, 48.0, 62.0, -24.0, 72.0) / 98.0;

vec3 face_direction(int face, vec2 st)
{
  /* forward + s·right + t·up, not normalised */
  switch (face) {
    case 0: return CUBE_TURN * vec3(1.0, -st.x, st.y);
    case 1: return CUBE_TURN * vec3(-1.0, st.x, st.y);
    case 2: return CUBE_TURN * vec3(st.x, 1.0, st.y);
    case 3: return CUBE_TURN * vec3(-st.x, -1.0, st.y);
    case 4: return CUBE_TURN * vec3(st.x, -st.y, 1.0);
    default: return CUBE_TURN * vec3(st.x, st.y, -1.0);
  }
}

/* Direction through `place` (0..1) of a texel. */
vec3 texel_place_direction(ivec2 texel, vec2 place)
{
  int face = texel.y / FACE;
  vec2 st = (vec2(texel.x, texel.y - face * FACE) + place) * (2.0 / float(FACE)) - 1.0;
  return normalize(face_direction(face, st));
}

vec3 texel_direction(ivec2 texel)
{
  return texel_place_direction(texel, vec2(0.5));
}

ivec2 direction_texel(vec3 direction)
{
  direction = direction * CUBE_TURN; /* by the transposed matrix */
  vec3 size = abs(direction);
  int face;
  vec2 st;
  if (size.x >= size.y && size.x >= size.z) {
    face = direction.x < 0.0 ? 1 : 0;
    st = vec2(direction.x < 0.0 ? direction.y : -direction.y, direction.z) / size.x;
  }
  else if (size.y >= size.z) {
    face = direction.y < 0.0 ? 3 : 2;
    st = vec2(direction.y < 0.0 ? -direction.x : direction.x, direction.z) / size.y;
  }
  else {
    face = direction.z < 0.0 ? 5 : 4;
    st = vec2(direction.x, direction.z < 0.0 ? direction.y : -direction.y) / size.z;
  }
  ivec2 texel = clamp(ivec2((st * 0.5 + 0.5) * float(FACE)), ivec2(0), ivec2(FACE - 1));
  return ivec2(texel.x, face * FACE + texel.y);
}
