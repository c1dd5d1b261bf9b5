/* Light of texels by the patches that they lie on: albedo.w is the patch, −1 for none. */

/* Reflected radiance times π of the texel's own patch, from `patch_irradiance`. */
vec3 texel_reflected(ivec3 at)
{
  vec4 reflects = texelFetch(albedo, at, 0);
  return reflects.w >= 0.0 ? reflects.rgb * element(patch_irradiance, int(reflects.w)).rgb : vec3(0.0);
}
