/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Two elements a key: the hash's first two numbers in halves of 16 bits; the R2 sample and the hash's third number.
 * keys: high and low 16 bits of x and y; low_key: those of z, sample index. */

void main()
{
  int i = int(gl_GlobalInvocationID.x);
  if (i < count) {
    uvec4 xy = uvec4(element(keys, i));
    vec4 rest = element(more_keys, i);
    uvec3 key = uvec3(xy.x << 16u | xy.y, xy.z << 16u | xy.w, uint(rest.x) << 16u | uint(rest.y));
    uvec3 hash = pcg3d(key);
    imageStore(result, element_position(2 * i), vec4(hash.x >> 16u, hash.x & 65535u, hash.y >> 16u, hash.y & 65535u));
    imageStore(result, element_position(2 * i + 1), vec4(sample_r2(key, int(rest.z)), hash.z >> 16u, hash.z & 65535u));
  }
}
