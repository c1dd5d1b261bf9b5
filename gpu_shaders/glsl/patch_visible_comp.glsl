/* Does each hit see the leader of its patch? Keeps a cell that a wall cuts in two from becoming one patch.
 *
 * Dispatch: one thread an entry of `pairs` (hit, patch); groups of 64. Both ends are raised off the surface, so that a curved one does
 * not hide its own parts; obstacles lower than that do not count.
 */

const float RAISE = 0.15; /* of the distance between the two */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= pair_count) {
    return;
  }
  ivec2 pair = ivec2(element(pairs, entry).xy);
  vec4 hit = element(hits, pair.x);
  vec4 leader = element(patch_points, POINTS * pair.y);
  float apart = distance(hit.xyz, leader.xyz);
  vec3 from = leave_surface(hit.xyz, unpack_normal(hit.w)) + unpack_normal(hit.w) * (RAISE * apart);
  vec3 to = leave_surface(leader.xyz, unpack_normal(leader.w)) + unpack_normal(leader.w) * (RAISE * apart);
  float range = distance(from, to);
  bool hidden = range > 0.0 && trace_any(from, (to - from) / range, range);
  imageStore(visible, element_position(entry), vec4(hidden ? 0.0 : 1.0));
}
