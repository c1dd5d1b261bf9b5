/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How the surfaces at places that light is measured at take light of grazing angles, see coupling_lib.
 *
 * couplings, 2 elements a place: the coupling; mean albedo, material, negative where light is sent evenly
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
  vec4 at = element(patch_points, POINTS * place);
  vec4 found = vec4(0.0, 0.0, 0.0, 1.0), made_of = vec4(0.0, 0.0, 0.0, -1.0);
  if (at.w >= 0.0) {
    vec3 normal = unpack_normal(at.w), origin = leave_surface(at.xyz, normal);
    Hit hit = trace_within(origin, -normal, SEARCH * distance(origin, at.xyz));
    if (hit.triangle >= 0) {
      Surface surface = resolve_surface(hit.triangle, hit.barycentric, origin, -normal, 0.5);
      float material = element(triangle_attributes, 5 * hit.triangle).w;
      found = surface.coupling;
      made_of = vec4(surface.mean_albedo, found.rgb != vec3(0.0) ? material : -1.0);
    }
  }
  imageStore(couplings, element_position(2 * place), found);
  imageStore(couplings, element_position(2 * place + 1), made_of);
}
