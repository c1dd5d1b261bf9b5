/* Sets elements first .. first + count of a linear array to `value`.
 *
 * Dispatch: one thread an element; groups of 64.
 */

void main()
{
  int index = LINEAR_THREAD;
  if (index < count) {
    imageStore(target, element_position(first + index), vec4(value));
  }
}
