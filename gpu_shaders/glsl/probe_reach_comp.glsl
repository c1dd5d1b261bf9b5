/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Which probes can see a change of shape and must be captured again: one number a probe, 1 or 0.
 *
 * Dispatch: one group of GROUP threads a probe; threads take texels in strides and stop when one has found something.
 * change_boxes, two elements a box: low and high corner; the first old_count boxes hold what is gone, the others what
 * is new.
 * Reference: core/change_reach.py, probes_that_see.
 */

const float ROUNDING = 1.0e-5;

SHARED_ int found;

bool sees_change(vec3 origin, vec3 direction, float reach)
{
  for (int i = 0; i < box_count; i++) {
    vec2 inside = clip_to_box(
        element(change_boxes, 2 * i).xyz, element(change_boxes, 2 * i + 1).xyz, origin, direction);
    bool met = inside.x <= inside.y && inside.x <= reach * (1.0 + ROUNDING);
    if (met && (i >= old_count || inside.y >= reach * (1.0 - ROUNDING))) {
      return true;
    }
  }
  return false;
}

void main()
{
  int probe = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  if (lane == 0) {
    found = 0;
  }
  barrier();
  vec3 origin = element(probe_slots, first_slot + probe).xyz;
  for (int i = lane; i < 6 * FACE * FACE && found == 0; i += GROUP) {
    ivec3 at = ivec3(i % FACE, i / FACE, probe);
    if (sees_change(origin, texel_direction(at.xy), abs(texelFetch(geometry, at, 0).z))) {
      found = 1;
    }
  }
  barrier();
  if (lane == 0) {
    imageStore(reached, element_position(probe), vec4(float(found)));
  }
}
