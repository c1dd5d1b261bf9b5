/* SPDX-License-Identifier: GPL-3.0-or-later */
/* How fast the device moves memory: copies an image, 32 bytes a thread.
 *
 * Dispatch: one thread a texel; groups of 16×16.
 */

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  imageStore(to_texels, texel, texelFetch(from_texels, texel, 0));
}
