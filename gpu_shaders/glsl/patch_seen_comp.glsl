/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Marks the patches that texels of some probes lie on; with REFLECTIONS also those that they mirror.
 *
 * Dispatch: one group of 64 threads a probe. probe_layers, 1 element a probe of the dispatch: its layer.
 */

void main()
{
  int layer = int(element(probe_layers, int(gl_WorkGroupID.x)).x);
  for (int i = int(gl_LocalInvocationID.x); i < 6 * FACE * FACE; i += 64) {
    float number = texelFetch(albedo, ivec3(i % FACE, i / FACE, layer), 0).w;
    if (number >= 0.0) {
      imageStore(seen, element_position(int(number)), vec4(1.0));
    }
#ifdef REFLECTIONS
    int first = (layer * 6 * FACE * FACE + i) * (REFLECTIONS + 1);
    for (int ray = 1; ray <= REFLECTIONS; ray++) {
      float end = element(mirrored, first + ray).w;
      if (end >= 0.0) {
        imageStore(seen, element_position(int(end)), vec4(1.0));
      }
    }
#endif
  }
}
