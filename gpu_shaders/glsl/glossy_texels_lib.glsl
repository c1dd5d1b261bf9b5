/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Texels on surfaces whose gloss is followed, as compactions pick them (compaction_lib): texel_count from that of
 * first_layer on. */

int item(int entry)
{
  return entry < texel_count ? entry : -1;
}

bool is_selected(int texel)
{
  if (texel < 0) {
    return false;
  }
  int row = texel / FACE;
  vec4 seen = texelFetch(geometry, ivec3(texel % FACE, row % (6 * FACE), first_layer + row / (6 * FACE)), 0);
  if (seen.z >= NO_SURFACE) {
    return false;
  }
  int material = int(element(triangle_attributes, 5 * int(seen.w)).w);
  return element(gloss_rows, 2 * material).rgb != vec3(0.0);
}
