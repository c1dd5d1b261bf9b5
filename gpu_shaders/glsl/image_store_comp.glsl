/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Texels of an image as half floats, from `first` on; what half floats cannot hold is cut off.
 *
 * Dispatch: one thread a texel; groups of 64. Some drivers cut digits off where they store half floats, which would
 * darken every image, so texels are rounded (to nearest, ties to even) before.
 */

void main()
{
  int index = LINEAR_THREAD;
  if (index < count) {
    uvec4 bits = floatBitsToUint(min(element(texels, index), vec4(HALF_MAX)));
    bits = (bits + 0xFFFu + ((bits >> 13u) & 1u)) & ~0x1FFFu;
    imageStore(halves, element_position(first + index), uintBitsToFloat(bits));
  }
}
