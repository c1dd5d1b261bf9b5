/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One bounce between patches: irradiance = direct + brought along + mean over rays of (albedo · irradiance where the
 * ray ended).
 *
 * Rays are cosine-weighted, so π·mean(radiance) is the irradiance and π cancels against albedo/π. Ends that lie on no
 * patch are left out of the mean: the row sums of the transport stay right, a furnace stays a furnace.
 * Dispatch: one thread a patch; groups of 64. ray_ends: −1 no patch, −2 nothing comes back.
 * Reference: core/reference_light.py, bounce.
 */

void main()
{
  int patch_index = LINEAR_THREAD;
  if (patch_index >= patch_count) {
    return;
  }
  vec3 irradiance = element(direct, patch_index).rgb;
  if (bounce != 0) {
    vec3 sum = vec3(0.0);
    int counted = 0;
    for (int i = patch_index * rays_each; i < (patch_index + 1) * rays_each; i++) {
      int end = int(element(ray_ends, i).x);
      counted += end != -1 ? 1 : 0;
      if (end >= 0) {
        sum += element(reflected, i).rgb * element(irradiance_in, end).rgb;
      }
    }
    irradiance += element(brought, patch_index).rgb + sum / float(max(counted, 1));
  }
  imageStore(irradiance_out, element_position(patch_index), vec4(irradiance, 0.0));
}
