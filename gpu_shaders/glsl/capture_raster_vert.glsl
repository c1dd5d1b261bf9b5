/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Capture by the layered pass: an instance is one cluster of triangles drawn into one face of one probe.
 *
 * Draw: 3·CLUSTER_SIZE vertices, one instance per visible (cluster, layer) pair listed in `instances`; layer = probe·6
 * + face of the batch. Vertices are pulled from the triangle texture, so every cluster and every face goes in one draw.
 */

void main()
{
  vec4 pair = element(instances, gl_InstanceID);
  int cluster = int(pair.x);
  int layer = int(pair.y);
  int vertex = int(vertex_number);
  int probe = layer / 6;
  int face = layer - probe * 6;
  int index = min(cluster * CLUSTER_SIZE + vertex / 3, triangle_count - 1);
  int corner = vertex - vertex / 3 * 3;
  vec3 position = element(triangle_corners, 3 * index + corner).xyz - element(probe_slots, first_slot + probe).xyz;

  vec3 forward = face_direction(face, vec2(0.0));
  vec3 right = face_direction(face, vec2(1.0, 0.0)) - forward;
  vec3 up = face_direction(face, vec2(0.0, 1.0)) - forward;
  float depth = dot(position, forward);
  /* Clips at near_distance and nowhere far; the depth that is tested comes from the fragment stage, linear and so
   * precise at any distance. */
  gl_Position = vec4(dot(position, right), dot(position, up), 0.5 * depth - 1.5 * near_distance, depth);
  gl_Layer = layer;
  hit_triangle = float(index);
  hit_layer = float(layer);
}
