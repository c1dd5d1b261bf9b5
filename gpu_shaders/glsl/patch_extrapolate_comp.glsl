/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Adds the bounces still to come where they shrink by a constant ratio: irradiance += factor · (irradiance − old).
 *
 * Dispatch: one thread a patch; groups of 64. Aitken's delta-squared process on the dominant mode.
 */

void main()
{
  int i = LINEAR_THREAD;
  if (i >= patch_count) {
    return;
  }
  vec4 fresh = imageLoad(irradiance, element_position(i));
  imageStore(irradiance, element_position(i), fresh + factor * (fresh - element(irradiance_old, i)));
}
