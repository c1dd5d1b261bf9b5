/* What texels on glossy surfaces see mirrored: REFLECTIONS rays each, which go on until they end on something diffuse.
 *
 * Dispatch: x = columns, y = 6·FACE rows, z = probes; groups of 8×8×1. Texel of the dispatch: (probe · 6·FACE + row) · FACE + column.
 * Writes for each ray `hits` (position, packed normal; −1 where nothing more comes), `hit_sheets` and `reflected`, by which the light there
 * counts; for each texel `carried`, what its rays brought along; and into `albedo`, what glossy texels send back diffusely.
 * Reference: core/reference_gloss.py.
 */

void main()
{
  ivec3 id = ivec3(gl_GlobalInvocationID);
  if (id.x >= FACE || id.y >= 6 * FACE) {
    return;
  }
  ivec3 at = ivec3(id.xy, first_layer + id.z);
  int texel = (id.z * 6 * FACE + id.y) * FACE + id.x;
  vec4 seen = texelFetch(geometry, at, 0);
  int triangle = int(seen.w);
  Gloss gloss = Gloss(vec3(0.0), 0.0, vec3(0.0), false);
  if (seen.z < NO_SURFACE) {
    gloss = gloss_of(triangle);
  }
  bool is_glossy = gloss.share != vec3(0.0);
  vec4 slot = element(probe_slots, first_slot + id.z);
  vec3 direction = texel_direction(id.xy);
  Surface surface;
  if (is_glossy) {
    vec2 barycentric = barycentric_of(triangle, slot.xyz + direction * abs(seen.z));
    surface = resolve_surface(triangle, barycentric, slot.xyz, direction, 2.0 / float(FACE));
  }
  uvec3 key = uvec3(uint(slot.w), 0x165667B1u, uint(seed));
  vec3 diffuse = vec3(0.0), brought = vec3(0.0);
  for (int ray = 0; ray < REFLECTIONS; ray++) {
    vec4 end = vec4(0.0, 0.0, 0.0, -1.0);
    vec3 sent = vec3(0.0);
    int sheet = 0;
    if (is_glossy) {
      int number = (id.y * FACE + id.x) * REFLECTIONS + ray;
      uvec3 event = reflection_event(key, number, 0);
      Reflection reflection = reflect_at(gloss, surface, triangle, -direction, event, sample_r2(key, number));
      diffuse += reflection.diffuse;
      Way way = Way(direction, Hit(abs(seen.z), triangle, vec2(0.0)), surface, vec3(1.0), vec3(0.0));
      go_on(way, gloss, reflection, 1.0, event, TEXEL_BLUR, 2.0 / float(FACE));
      follow_reflections(way, key, number, 1, MOST_REFLECTIONS - 1, PATCH_BLUR, 2.0 / float(FACE));
      brought += way.brought;
      sent = way.throughput == vec3(0.0) ? vec3(0.0) : way.throughput * way.surface.albedo;
      if (sent != vec3(0.0)) {
#ifdef HAS_SHEETS
        sheet = sheet_of_triangle(way.hit.triangle);
#endif
        end.xyz = sheet > 0 ? way.surface.position : pull_back(way.surface.position, way.direction, way.hit.distance);
        end.w = pack_normal(octahedral_encode(way.surface.normal));
      }
    }
    ivec2 place = element_position(texel * REFLECTIONS + ray);
    imageStore(hits, place, end);
    imageStore(reflected, place, vec4(sent, 0.0));
#ifdef HAS_SHEETS
    imageStore(hit_sheets, place, vec4(float(sheet)));
#endif
  }
  imageStore(carried, element_position(texel), vec4(brought / float(REFLECTIONS), 0.0));
  if (is_glossy) {
    imageStore(albedo, at, vec4(diffuse / float(REFLECTIONS), imageLoad(albedo, at).w));
  }
}
