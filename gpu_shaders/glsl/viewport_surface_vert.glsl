/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The scene's triangles in a view, vertex stage: pulled from the triangle texture, so one draw shows the whole scene.
 *
 * Draw: 3·CLUSTER_SIZE vertices, one instance per cluster of triangles in leaf order. Objects that this view hides
 * (local view, hidden collections) are left out here; they still light the rest.
 * view_info: camera position, 1 if orthographic | right and up, scaled to the edge of the image | forward, width of a
 *            pixel | rows of the matrix to clip space (4..7), jitter included | jitter in clip space (8)
 * object_flags, 1 element an object: 1 if visible
 */

void main()
{
  int vertex = int(vertex_number);
  int index = gl_InstanceID * CLUSTER_SIZE + vertex / 3;
  int corner = vertex - vertex / 3 * 3;
  bool shown = index < triangle_count;
  index = min(index, triangle_count - 1);
  shown = shown && element(object_flags, int(element(triangle_attributes, 5 * index + 1).w)).x != 0.0;
  surface_point = element(triangle_corners, 3 * index + corner).xyz;
  vec4 point = vec4(surface_point, 1.0);
  vec4 clip = vec4(
      dot(view_info[4], point), dot(view_info[5], point), dot(view_info[6], point), dot(view_info[7], point));
  gl_Position = shown ? clip : vec4(2.0, 2.0, 2.0, 1.0);
  surface_triangle = float(index);
  surface_barycentric = vec2(corner == 1 ? 1.0 : 0.0, corner == 2 ? 1.0 : 0.0);
}
