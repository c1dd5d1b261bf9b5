/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Notes in albedo.w on which patch each texel lies, −1 for none.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. `patches` counts texels as texel_hits_comp does.
 */

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 at = ivec3(id.xy, first_layer + id.z);
  int texel = (id.z * 6 * FACE + id.y) * FACE + id.x;
  imageStore(albedo, at, vec4(imageLoad(albedo, at).rgb, element(patches, texel).x));
}
