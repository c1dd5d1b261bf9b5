/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The octahedral map of directions (Cigolle et al., "A Survey of Efficient Representations for Independent Unit
 * Vectors", JCGT 2014) and normals packed into one number. Reference: core/cubemap.py.
 */

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

const float NORMAL_STEPS = 2047.0;

/* An octahedral normal as one whole number, which a float holds exactly. */
float pack_normal(vec2 uv)
{
  vec2 steps = round(clamp(uv, -1.0, 1.0) * NORMAL_STEPS) + 2048.0;
  return steps.x + 4096.0 * steps.y;
}

vec3 unpack_normal(float number)
{
  float high = floor(number / 4096.0);
  return octahedral_decode((vec2(number - 4096.0 * high, high) - 2048.0) / NORMAL_STEPS);
}
