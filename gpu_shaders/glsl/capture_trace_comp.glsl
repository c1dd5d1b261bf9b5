/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Capture by rays: one ray through the centre of each texel of each face of a batch of probes.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes of the batch; groups of 8×8×1.
 * Writes hits (triangle, barycentric 1, barycentric 2, unused) into layer probe·6 + face; triangle −1 where nothing is
 * hit.
 */

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  vec3 origin = element(probe_slots, first_slot + id.z).xyz;
  Hit hit = trace_closest(origin, texel_direction(id.xy));
  int face = id.y / FACE;
  imageStore(hits, ivec3(id.x, id.y - face * FACE, id.z * 6 + face), vec4(float(hit.triangle), hit.barycentric, 0.0));
}
