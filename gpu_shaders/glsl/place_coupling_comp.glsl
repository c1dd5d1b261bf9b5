/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How the surfaces at places that light is measured at take light of grazing angles, see coupling_lib.
 *
 * Dispatch: one thread for each of place_count patches or texels from first_place on, of which the first point is
 * asked; groups of 64. The surface is looked for right below the point, where the ray that found it left it.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= place_count) {
    return;
  }
  int place = first_place + entry;
  vec4 at = element(patch_points, POINTS * place), found = vec4(0.0, 0.0, 0.0, 1.0);
  if (at.w >= 0.0) {
    vec3 normal = unpack_normal(at.w), origin = leave_surface(at.xyz, normal);
    Hit hit = trace_within(origin, -normal, SEARCH * distance(origin, at.xyz));
    if (hit.triangle >= 0) {
      found = resolve_surface(hit.triangle, hit.barycentric, origin, -normal, 0.5).coupling;
    }
  }
  imageStore(couplings, element_position(place), found);
}
