/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Takes texel surfaces over from one set of layers to another: layer z of the new one comes from layer from_layer[z].x
 * of the old one, or is left alone where that is negative.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = layers of the new set; groups of 8×8×1.
 */

void main()
{
  ivec3 at = ivec3(gl_GlobalInvocationID);
  int source = int(element(from_layer, at.z).x);
  if (at.x >= FACE || at.y >= 6 * FACE || source < 0) {
    return;
  }
  ivec3 from = ivec3(at.xy, source);
  imageStore(geometry, at, texelFetch(old_geometry, from, 0));
  imageStore(albedo, at, texelFetch(old_albedo, from, 0));
  imageStore(emission, at, texelFetch(old_emission, from, 0));
}
