/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which places on sampled emitters a probe sees by its texels and which by points on the emitters: whichever are denser
 * there. */

/* CANDIDATE_COUNT points on emitters, per steradian as a probe sees them. */
float point_density(float density, float squared_distance, float cosine)
{
  return float(CANDIDATE_COUNT) * density * squared_distance / cosine;
}

/* Radiance of a sampled emitter in a texel that answers for it, black elsewhere. */
vec3 texel_emitter(ivec3 at)
{
  vec4 emitted = texelFetch(emission, at, 0);
  if (emitted.a == 0.0) {
    return vec3(0.0);
  }
  vec4 seen = texelFetch(geometry, at, 0);
  float cosine = max(abs(dot(texel_direction(at.xy), octahedral_decode(seen.xy))), 1.0e-4);
  float weight = element(texel_weights, (at.y % FACE) * FACE + at.x).x;
  return point_density(emitted.a, seen.z * seen.z, cosine) * weight < 1.0 ? emitted.rgb : vec3(0.0);
}
