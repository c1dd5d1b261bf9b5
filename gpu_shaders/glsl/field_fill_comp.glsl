/* Copies an active probe's coefficients to each inactive node that stands in for nothing else: a lookup whose cell has no active
 * corner then still reads light instead of black.
 *
 * Dispatch: one thread per (inactive node, coefficient); groups of 64. inactive_nodes: (node, substitute).
 */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  int entry = i / COEFFICIENTS;
  if (entry >= inactive_count) {
    return;
  }
  ivec2 pair = ivec2(element(inactive_nodes, entry).xy);
  int c = i - entry * COEFFICIENTS;
  imageStore(field, element_position(pair.x * COEFFICIENTS + c), imageLoad(field, element_position(pair.y * COEFFICIENTS + c)));
}
