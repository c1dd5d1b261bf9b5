// SPDX-License-Identifier: GPL-3.0-or-later
// Copies an image, one thread a texel: 32 bytes move per thread. Dispatched as (width / 16, height / 16, 1).

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  imageStore(to_texels, texel, texelFetch(from_texels, texel, 0));
}
