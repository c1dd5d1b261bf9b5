/* Linear arrays of vec4 in 2D textures: element i sits at (i & 4095, i >> 12). Python side: textures.py. */

vec4 element(sampler2D data, int index)
{
  return texelFetch(data, ivec2(index & 4095, index >> 12), 0);
}

ivec2 element_position(int index)
{
  return ivec2(index & 4095, index >> 12);
}
