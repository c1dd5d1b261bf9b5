/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The world behind the scene, fragment stage. view_info as in viewport_surface_vert. */

void main()
{
  vec2 moved = place - view_info[8].xy;
  vec3 across = view_info[0].w != 0.0 ? vec3(0.0) : view_info[1].xyz * moved.x + view_info[2].xyz * moved.y;
  ivec2 texel = direction_texel(normalize(view_info[3].xyz + across));
  radiance_sum = vec4(element(world_texels, texel.y * FACE + texel.x).rgb, 1.0);
}
