/* How unevenly lamps and sampled emitters light the points of each patch if nothing stands between: what decides how many of them get
 * shadow rays.
 *
 * Dispatch: one thread a patch from first_patch on; groups of 64. Writes mean and standard deviation of the luminance of the points'
 * irradiance.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= patch_count) {
    return;
  }
  int patch_index = first_patch + entry;
  uvec3 key = uvec3(uint(patch_index), 0u, uint(seed));
  float sum = 0.0, squares = 0.0;
  for (int i = 0; i < POINTS; i++) {
    vec4 at = element(patch_points, POINTS * patch_index + i);
    vec3 irradiance = lamps_unshadowed(at.xyz, unpack_normal(at.w), key, i);
#ifdef HAS_EMITTERS
    irradiance += emitter_unshadowed(at.xyz, unpack_normal(at.w), key, i);
#endif
    float luminance = dot(irradiance, vec3(0.2126, 0.7152, 0.0722));
    sum += luminance;
    squares += luminance * luminance;
  }
  float mean = sum / float(POINTS);
  float deviation = sqrt(max(squares / float(POINTS) - mean * mean, 0.0));
  imageStore(spread, element_position(patch_index), vec4(mean, deviation, 0.0, 0.0));
}
