/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Points of new patches: the leader, then the hits that won a place, evenly.
 *
 * Dispatch: one thread a patch from first_new on; groups of 64.
 */

const uint UNSCRAMBLE = 0x0E8B2F51u; /* times 0x9E3779B1 is 1 modulo 2³² */

void main()
{
  int patch_index = first_new + LINEAR_THREAD;
  if (patch_index >= patch_count) {
    return;
  }
  int chosen[POINTS];
  int count = 1; /* the leader stands at place 0 already, instead of who won it */
  for (int i = 1; i < POINTS; i++) {
    uint candidate = texelFetch(candidates, element_position(patch_index * POINTS + i), 0).x;
    if (candidate != 0xFFFFFFFFu) {
      chosen[count++] = int(candidate * UNSCRAMBLE);
    }
  }
  for (int i = POINTS - 1; i > 0; i--) {
    int from = i * count / POINTS;
    vec4 point = from == 0 ? imageLoad(patch_points, element_position(patch_index * POINTS)) :
                             element(hits, chosen[from]);
    imageStore(patch_points, element_position(patch_index * POINTS + i), point);
  }
}
