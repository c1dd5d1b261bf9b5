/* Light of texels by the patches that they lie on: albedo.w is the patch, −1 for none. */

/* Reflected radiance times π of a texel whose irradiance is an element of `patch_irradiance`: that of its patch, or `own`
 * where that is not negative. */
vec3 texel_reflected(ivec3 at, int own)
{
  vec4 reflects = texelFetch(albedo, at, 0);
  int index = own >= 0 ? own : int(reflects.w);
  return reflects.w >= 0.0 ? reflects.rgb * element(patch_irradiance, index).rgb : vec3(0.0);
}
