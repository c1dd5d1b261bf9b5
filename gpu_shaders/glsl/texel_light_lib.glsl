/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Light of texels by the patches that they lie on: albedo.w is the patch, −1 for none; with REFLECTIONS also what they
 * mirror, see texel_mirrored_comp. */

#ifdef REFLECTIONS
/* Radiance times π that a texel mirrors, by the light of patches. */
vec3 texel_mirrored(ivec3 at)
{
  int first = ((at.z * 6 * FACE + at.y) * FACE + at.x) * (REFLECTIONS + 1);
  vec3 sum = element(mirrored, first).rgb * 3.141592653589793;
  for (int ray = 1; ray <= REFLECTIONS; ray++) {
    vec4 part = element(mirrored, first + ray);
    sum += part.w >= 0.0 ? part.rgb * element(mirrored_irradiance, int(part.w)).rgb : vec3(0.0);
  }
  return sum;
}
#endif

/* Reflected radiance times π of a texel whose irradiance is an element of `patch_irradiance`: that of its patch, or
 * `own` where that is not negative. */
vec3 texel_reflected(ivec3 at, int own)
{
  vec4 reflects = texelFetch(albedo, at, 0);
  int index = own >= 0 ? own : int(reflects.w);
#ifdef REFLECTIONS
  vec3 diffuse = reflects.w >= 0.0 ? reflects.rgb * element(patch_irradiance, index).rgb : vec3(0.0);
  return diffuse + texel_mirrored(at);
#else
  return reflects.w >= 0.0 ? reflects.rgb * element(patch_irradiance, index).rgb : vec3(0.0);
#endif
}
