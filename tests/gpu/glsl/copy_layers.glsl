/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Copies a layered image into a linear array, layer by layer, row by row. */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    ivec3 at = ivec3(i % width, i / width % height, i / (width * height));
    imageStore(result, element_position(i), texelFetch(source, at, 0));
  }
}
