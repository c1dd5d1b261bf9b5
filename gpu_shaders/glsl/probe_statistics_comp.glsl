/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What each probe sees as a whole: the depth statistics of its lookup and how much of it is back faces, background and
 * lit.
 *
 * Dispatch: one group of 64 threads a probe; thread t makes texel t of the octahedral map from 16 directions spread
 * over DEPTH_SPREAD of it, and what is in its middle, where the plane of what the texel there
 * sees is: the background faces the probe.
 * Back faces of `shells` do not count (core/orientation.py).
 * Writes depth_statistics (mean and mean square of the clamped distance; packed normal and distance in the middle) and
 * probe_shares, shares of the sphere: back faces of solids, background, anything that sends light, all back faces.
 */

SHARED_ vec4 partial_shares[64];

void main()
{
  int probe = int(gl_WorkGroupID.x);
  int lane = int(gl_LocalInvocationID.x);
  int slot = first_slot + probe;
  int layer = first_layer + probe;

  vec2 texel = vec2(lane % DEPTH_EDGE, lane / DEPTH_EDGE);
  vec2 moments = vec2(0.0);
  for (int i = 0; i < 16; i++) {
    vec2 place = texel + 0.5 + (vec2(i & 3, i >> 2) - 1.5) * (DEPTH_SPREAD / 4.0);
    vec3 direction = octahedral_decode(place * (2.0 / float(DEPTH_EDGE)) - 1.0);
    float range = abs(texelFetch(geometry, ivec3(direction_texel(direction), layer), 0).z);
    range = min(range, depth_clamp);
    moments += vec2(range, range * range);
  }
  vec3 middle = octahedral_decode((texel + 0.5) * (2.0 / float(DEPTH_EDGE)) - 1.0);
  ivec2 at = direction_texel(middle);
  vec3 seen = texelFetch(geometry, ivec3(at, layer), 0).xyz;
  vec4 statistics = vec4(moments / 16.0, pack_normal(octahedral_encode(-middle)), depth_clamp);
  if (seen.z < NO_SURFACE) {
    vec3 normal = octahedral_decode(seen.xy);
    float slant = dot(normal, texel_direction(at)) / min(dot(normal, middle), -LEAST_COSINE);
    statistics.zw = vec2(pack_normal(seen.xy), abs(seen.z) * (slant > 0.0 ? slant : 1.0));
  }
  imageStore(depth_statistics, element_position(slot * DEPTH_EDGE * DEPTH_EDGE + lane), statistics);

  vec4 share = vec4(0.0);
  for (int i = lane; i < 6 * FACE * FACE; i += 64) {
    ivec3 at = ivec3(i % FACE, i / FACE, layer);
    vec2 seen = texelFetch(geometry, at, 0).zw;
    float weight = element(texel_weights, (at.y % FACE) * FACE + at.x).x;
    if (seen.x >= NO_SURFACE) {
      share.y += weight;
    }
    else if (seen.x < 0.0) {
      share.w += weight;
      float object = element(triangle_attributes, 5 * int(seen.y) + 1).w;
      share.x += element(shells, int(object)).x == 0.0 ? weight : 0.0;
    }
    vec3 light = texelFetch(emission, at, 0).rgb + texel_reflected(at, -1);
    share.z += light != vec3(0.0) ? weight : 0.0;
  }
  partial_shares[lane] = share;
  barrier();
  if (lane == 0) {
    vec4 sum = vec4(0.0);
    for (int i = 0; i < 64; i++) {
      sum += partial_shares[i];
    }
    imageStore(probe_shares, element_position(slot), sum / 12.566370614359172);
  }
}
