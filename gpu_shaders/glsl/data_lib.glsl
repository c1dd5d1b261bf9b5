/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Linear arrays of vec4 in 2D textures: element i sits at (i & 4095, i >> 12). Python side: textures.py. */

vec4 element(sampler2D data, int index)
{
  return texelFetch(data, ivec2(index & 4095, index >> 12), 0);
}

ivec2 element_position(int index)
{
  return ivec2(index & 4095, index >> 12);
}

/* Number of a thread of a linear dispatch, which is rows of 2²¹ threads: Python side as well. */
#define LINEAR_THREAD (int(gl_GlobalInvocationID.y) * 2097152 + int(gl_GlobalInvocationID.x))
