/* Adds the bounces still to come where they shrink by a constant ratio: field += factor · (field − old).
 *
 * Dispatch: one thread per coefficient of every node; groups of 64. Aitken's delta-squared process on the dominant mode.
 */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i >= element_count) {
    return;
  }
  vec4 fresh = imageLoad(field, element_position(i));
  imageStore(field, element_position(i), fresh + factor * (fresh - element(field_old, i)));
}
