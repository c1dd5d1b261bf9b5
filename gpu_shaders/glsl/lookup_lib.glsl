/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The field's lookup: trilinear between the eight probes of a cell, weighted by whether each probe sees the point.
 * Reference and reasons: core/lookup.py and core/depth_map.py. Needs octahedral_lib. Chebyshev's inequality for
 * visibility: Donnelly and Lauritzen, "Variance Shadow Maps", I3D 2006; in probe grids: Majercik et al., "Dynamic
 * Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 2019.
 *
 * grid_info: rows of world-to-lattice (0..2); resolution, depth clamp (3); least deviation (4)
 * grid_nodes, 1 element a node: capture position, slot of an active probe, −1 culled, −2 invalid
 * sights: DEPTH_EDGE² elements a slot, see core/depth_map.py. In inverse distances, those of the depth clamp: packed
 *   normal n of the plane in the middle and l, so that it is l n · d along d; mean, negative where the plane is not
 *   known; variance
 */

int node_index(ivec3 node)
{
  ivec3 resolution = ivec3(grid_info[3].xyz);
  return node.x + resolution.x * (node.y + resolution.y * node.z);
}

ivec2 wrap_octahedral(ivec2 texel)
{
  if (texel.x < 0 || texel.x >= DEPTH_EDGE) {
    texel = ivec2(texel.x < 0 ? -1 - texel.x : 2 * DEPTH_EDGE - 1 - texel.x, DEPTH_EDGE - 1 - texel.y);
  }
  if (texel.y < 0 || texel.y >= DEPTH_EDGE) {
    texel = ivec2(DEPTH_EDGE - 1 - texel.x, texel.y < 0 ? -1 - texel.y : 2 * DEPTH_EDGE - 1 - texel.y);
  }
  return texel;
}

/* Weights of the texels from a corner on (x fastest) at `blend` between them: bilinear, or linear in each of two
 * triangles where the octahedron's edge z = 0 cuts the four in half. `middle`: of the four, in half texels from the
 * middle of the map. */
vec4 texel_weights(vec2 blend, ivec2 middle)
{
  vec2 rest = 1.0 - blend;
  if (abs(middle.x) + abs(middle.y) != DEPTH_EDGE) {
    return vec4(rest.x * rest.y, blend.x * rest.y, rest.x * blend.y, blend.x * blend.y);
  }
  bvec2 turned = lessThan(middle, ivec2(0));
  vec2 outward = mix(blend, rest, turned);
  float past = outward.x + outward.y - 1.0;
  vec4 weights = past > 0.0 ? vec4(0.0, 1.0 - outward.y, 1.0 - outward.x, past) :
                              vec4(-past, outward.x, outward.y, 0.0);
  weights = turned.x ? weights.yxwz : weights;
  return turned.y ? weights.zwxy : weights;
}

/* How far the middle of a texel is from that of the octahedron |x| + |y| + |z| = 1. */
float octahedron_length(ivec2 texel)
{
  vec2 place = abs((vec2(texel) + 0.5) * (2.0 / float(DEPTH_EDGE)) - 1.0);
  float height = 1.0 - place.x - place.y;
  return length(vec3(height < 0.0 ? 1.0 - place.yx : place, height));
}

/* Inverse distance along `direction`, in those of the depth clamp, and its variance. Blended of four texels so that
 * their directions come to `direction`: planes are linear in it. No nearer than the planes that they see go on. Then
 * how much a place, `offset` from the probe in depth clamps, lies on one of them and looks as its back does. */
vec3 sample_inverse(int slot, vec3 direction, float most, vec3 offset, vec3 normal)
{
  float norm = dot(abs(direction), vec3(1.0)), halved = 1.0 / float(DEPTH_EDGE);
  vec2 flat_place = abs(direction.xy) / norm;
  float one_edge = (1.0 - halved) / max(1.0 - min(flat_place.x, flat_place.y), 1e-9);
  float two_edges = (1.0 - 2.0 * halved) / max(1.0 - flat_place.x - flat_place.y, 1e-9);
  float inside = min(1.0, min(one_edge, two_edges));
  vec2 place = inside * flat_place;
  place = direction.z < 0.0 ? 1.0 - place.yx : place;
  place *= mix(vec2(1.0), vec2(-1.0), lessThan(direction.xy, vec2(0.0)));
  vec2 position = (place * 0.5 + 0.5) * float(DEPTH_EDGE) - 0.5;
  ivec2 corner = ivec2(floor(position));
  vec4 weights = texel_weights(position - vec2(corner), 2 * (corner + 1) - DEPTH_EDGE);
  float scale = norm / inside;
  float blended = 0.0, spread = 0.0, nearest = 0.0, behind = 0.0;
  for (int i = 0; i < 4; i++) {
    ivec2 texel = wrap_octahedral(corner + ivec2(i & 1, i >> 1));
    vec4 sight = element(sights, (slot * DEPTH_EDGE + texel.y) * DEPTH_EDGE + texel.x);
    float share = min(scale * octahedron_length(texel), most / abs(sight.z));
    blended += weights[i] * share * abs(sight.z);
    spread += weights[i] * share * share * sight.w;
    vec3 away = unpack_normal(sight.x);
    nearest = max(nearest, sight.z < 0.0 ? most : min(sight.y * dot(away, direction), most));
    if (sight.z > 0.0 && sight.y > FARTHEST_PLANE && dot(away, normal) > LIKE_BACK) {
      float apart = abs(sight.y * dot(away, offset) - 1.0);
      behind = max(behind, clamp(2.0 - apart / ON_PLANE, 0.0, 1.0));
    }
  }
  float uneven = clamp(NOT_FLAT * (nearest / blended - 1.0), 0.0, 1.0);
  return vec3(min(blended, nearest), uneven * spread, behind);
}

/* How likely the probe in `slot` sees `point` on a surface with `normal`, 0..1. */
float visibility(int slot, vec3 probe, vec3 point, vec3 normal)
{
  vec3 there = point - probe;
  vec3 offset = there + OFF_SURFACE * length(there) * normal;
  float squared = dot(offset, offset);
  if (squared == 0.0) {
    return 1.0;
  }
  float distance = sqrt(squared);
  float inverse_there = max(grid_info[3].w / distance, FARTHEST);
  vec3 inverse = sample_inverse(slot, offset / distance, HIDES * inverse_there, there / grid_info[3].w, normal);
  float front = 1.0 - (1.0 - ON_BACK) * inverse.z;
  float beyond = inverse.x - inverse_there;
  if (beyond <= 0.0) {
    return front;
  }
  float least = grid_info[4].x / grid_info[3].w * inverse.x * inverse_there;
  float variance = max(inverse.y, least * least);
  float chance = variance / (variance + beyond * beyond);
  float fourth = chance * chance * chance * chance;
  return front * fourth * fourth * chance * chance; /* the tenth power */
}

/* `point` in node numbers, clamped to the box; `beyond`: cells past it. */
vec3 lattice_position(vec3 point, out vec3 beyond)
{
  vec4 homogeneous = vec4(point, 1.0);
  vec3 lattice = vec3(dot(grid_info[0], homogeneous), dot(grid_info[1], homogeneous), dot(grid_info[2], homogeneous));
  vec3 clamped = clamp(lattice, vec3(0.0), grid_info[3].xyz - 1.0);
  beyond = lattice - clamped;
  return clamped;
}

ivec3 first_corner(vec3 lattice)
{
  return min(ivec3(lattice), max(ivec3(grid_info[3].xyz) - 2, ivec3(0)));
}

/* What a node, as grid_nodes has it, counts by how likely it sees `point`. */
float seen_weight(vec4 node, vec3 point, vec3 normal)
{
  if (node.w >= 0.0) {
    return max(visibility(int(node.w), node.xyz, point, normal), LEAST_WEIGHT);
  }
  return node.w < -1.0 ? INVALID_WEIGHT : 1.0;
}

/* Step from the first corner of a cell to what is asked there as number `item`: its eight corners (x fastest), then the
 * 4 × 4 × 4 nodes that reach one step around, corners among them. */
ivec3 lookup_step(int item)
{
  if (item < 8) {
    return ivec3(item & 1, (item >> 1) & 1, item >> 2);
  }
  item -= 8;
  return ivec3(item & 3, (item >> 2) & 3, item >> 4) - 1;
}

bool is_corner(ivec3 step)
{
  return all(greaterThanEqual(step, ivec3(0))) && all(lessThanEqual(step, ivec3(1)));
}
