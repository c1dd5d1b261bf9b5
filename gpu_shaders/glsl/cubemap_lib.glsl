/* Cubemap texels and the octahedral map. Reference: core/cubemap.py; the faces are drawn in core/conventions.py.
 *
 * The surfaces of a probe are one layer, FACE wide and 6·FACE high: x = column, y = face·FACE + row.
 */

vec3 face_direction(int face, vec2 st)
{
  /* forward + s·right + t·up, not normalised */
  switch (face) {
    case 0: return vec3(1.0, -st.x, st.y);
    case 1: return vec3(-1.0, st.x, st.y);
    case 2: return vec3(st.x, 1.0, st.y);
    case 3: return vec3(-st.x, -1.0, st.y);
    case 4: return vec3(st.x, -st.y, 1.0);
    default: return vec3(st.x, st.y, -1.0);
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

vec3 octahedral_decode(vec2 uv)
{
  vec3 direction = vec3(uv, 1.0 - abs(uv.x) - abs(uv.y));
  float fold = max(-direction.z, 0.0);
  direction.x += direction.x >= 0.0 ? -fold : fold;
  direction.y += direction.y >= 0.0 ? -fold : fold;
  return normalize(direction);
}

vec2 octahedral_encode(vec3 direction)
{
  direction /= abs(direction.x) + abs(direction.y) + abs(direction.z);
  if (direction.z < 0.0) {
    vec2 folded = 1.0 - abs(direction.yx);
    return vec2(direction.x >= 0.0 ? folded.x : -folded.x, direction.y >= 0.0 ? folded.y : -folded.y);
  }
  return direction.xy;
}
