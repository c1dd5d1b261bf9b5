/* Adds to `direct` of each entry of `patches` from first_entry on, or begins it with, the mean over its samples, whose sums by runs of
 * them patch_direct_comp left.
 *
 * Dispatch: one thread an entry; groups of 64.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= patch_count) {
    return;
  }
  vec3 sum = vec3(0.0);
  for (int i = 0; i < runs; i++) {
    sum += element(sums, entry * runs + i).rgb;
  }
  ivec2 target = element_position(int(element(patches, first_entry + entry).x));
  vec4 before = begins != 0 ? vec4(0.0) : imageLoad(direct, target);
  imageStore(direct, target, before + vec4(sum / float(samples), 0.0));
}
