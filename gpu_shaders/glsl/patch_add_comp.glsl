/* Adds `added` to `total`, or begins with it.
 *
 * Dispatch: one thread a patch; groups of 64.
 */

void main()
{
  int index = LINEAR_THREAD;
  if (index < patch_count) {
    ivec2 place = element_position(index);
    vec4 before = begins != 0 ? vec4(0.0) : imageLoad(total, place);
    imageStore(total, place, before + element(added, index));
  }
}
