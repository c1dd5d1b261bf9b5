/* Capture by the layered pass, fragment stage: the same hit record that capture_trace_comp writes. */

void main()
{
#ifdef HAS_ALPHA
  int index = int(hit_triangle + 0.5);
  if (element(triangle_corners, 3 * index + 1).w != 0.0 && is_hole(index, hit_barycentric)) {
    discard;
  }
#endif
  gl_FragDepth = length(hit_offset) / far_distance;
  hit = vec4(floor(hit_triangle + 0.5), hit_barycentric, 0.0);
}
