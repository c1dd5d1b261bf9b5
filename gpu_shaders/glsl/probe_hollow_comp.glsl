/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Share of the texels of probes, of those that see patches, that lie on slow ones.
 *
 * Dispatch: one group of 64 threads a probe. probe_layers, 1 element a probe of the dispatch: its layer. shares: as
 * many.
 */

SHARED_ int partial_counts[128];

void main()
{
  int lane = int(gl_LocalInvocationID.x);
  int layer = int(element(probe_layers, int(gl_WorkGroupID.x)).x);
  int patches = 0, slow = 0;
  for (int i = lane; i < 6 * FACE * FACE; i += 64) {
    int number = int(texelFetch(albedo, ivec3(i % FACE, i / FACE, layer), 0).w);
    if (number >= 0) {
      vec3 fresh = element(irradiance_new, number).rgb, old = element(irradiance_old, number).rgb;
      patches++;
      slow += is_slow(fresh, fresh - old, old - element(irradiance_older, number).rgb) ? 1 : 0;
    }
  }
  partial_counts[lane] = patches;
  partial_counts[64 + lane] = slow;
  barrier();
  if (lane == 0) {
    for (int i = 1; i < 64; i++) {
      patches += partial_counts[i];
      slow += partial_counts[64 + i];
    }
    imageStore(shares, element_position(int(gl_WorkGroupID.x)), vec4(float(slow) / float(max(patches, 1))));
  }
}
