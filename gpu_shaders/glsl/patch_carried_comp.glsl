/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Irradiance of what the rays of each patch brought along.
 *
 * Dispatch: one thread a patch from first_patch on; groups of 64. `carried` counts rays from the first one of
 * first_patch.
 */

void main()
{
  int entry = LINEAR_THREAD;
  if (entry >= patch_count) {
    return;
  }
  vec3 sum = vec3(0.0);
  for (int i = 0; i < rays_each; i++) {
    sum += element(carried, entry * rays_each + i).rgb;
  }
  imageStore(brought, element_position(first_patch + entry), vec4(sum * (3.141592653589793 / float(rays_each)), 0.0));
}
