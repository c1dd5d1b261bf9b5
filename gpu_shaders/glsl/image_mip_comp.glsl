/* SPDX-License-Identifier: GPL-3.0-or-later */
/* One mip level of an image from the one before: means over equal parts, sizes halved and rounded down. Reference:
 * core/images.py.
 *
 * Dispatch: one thread a texel; groups of 64. Levels are linear arrays of their own rows, one after the other in
 * `texels`.
 */

void main()
{
  int index = LINEAR_THREAD;
  if (index >= width * height) {
    return;
  }
  ivec2 at = ivec2(index % width, index / width);
  ivec2 low = ivec2(at.x * before_width / width, at.y * before_height / height);
  ivec2 high = ivec2((at.x + 1) * before_width / width, (at.y + 1) * before_height / height);
  vec4 sum = vec4(0.0);
  for (int y = low.y; y < high.y; y++) {
    for (int x = low.x; x < high.x; x++) {
      sum += imageLoad(texels, element_position(before_start + y * before_width + x));
    }
  }
  ivec2 size = high - low;
  imageStore(texels, element_position(start + index), sum / float(size.x * size.y));
}
