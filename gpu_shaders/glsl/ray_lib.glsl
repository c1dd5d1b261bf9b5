/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rays through the four-wide hierarchy of core/bvh.py.
 *
 * Nodes are entered in order of distance; the stack holds what is left, STACK_SIZE entries at most (known when the
 * hierarchy is built). A ray goes down until it reaches a leaf before any of its neighbours' leaves is tested (Aila and
 * Laine, "Understanding the Efficiency of Ray Traversal on GPUs", HPG 2009): drivers that run threads side by side pay
 * for both kinds of step otherwise. The triangle test is watertight: Woop, Benthin and Wald, "Watertight Ray/Triangle
 * Intersection", JCGT 2013. Both sides of a triangle are hit. With HAS_ALPHA, triangles of clipped materials ask
 * surface_lib's `is_hole` first; with HAS_UNSEEN, rays pass triangles that their kind does not see; with HAS_LINKS,
 * shadow rays to an emitter those that are none of its blockers.
 *
 * Drivers put a copy of this code wherever a ray is traced, and some compile a program with eight of them for a minute
 * (docs/history.md): shaders trace all shadow rays of a place in one loop, and all others in another.
 *
 * Samplers: bvh_nodes, triangle_corners.
 */

const float NO_HIT = 3.0e38;
const int NO_NODE = -2147483647; /* in place of a node or leaf */
const int CLIPPED = 1, UNSEEN_BY_SHADOW_RAYS = 2, UNSEEN_BY_DIFFUSE_RAYS = 4, UNSEEN_FROM_BEHIND = 8,
          UNSEEN_FROM_FRONT = 16, UNSEEN_BY_CAMERA = 32, TINTED = 64; /* bits of a triangle, w of its corner 1 */
const int ROLE_SHIFT = 7; /* a triangle's role in light linking is what stands above its other bits */

#ifdef HAS_LINKS
/* Light linking, see core/light_links.py. links, LINK_GROUPS + 1 elements a role: group of its own emission; then for
 * each group whether its light falls on surfaces of this role, and whether they block it. Group 0 is not linked. */
int lit_role = -1; /* of the surface that is being lit, said before light is asked for; −1: an eye, which sees all */

int role_of_triangle(int triangle)
{
  return int(element(triangle_corners, 3 * triangle + 1).w) >> ROLE_SHIFT;
}

/* The group that the emission of a triangle belongs to. */
int group_of_triangle(int triangle)
{
  return int(element(links, role_of_triangle(triangle) * (LINK_GROUPS + 1)).x);
}

bool falls_on(int group, int role)
{
  return group == 0 || role < 0 || element(links, role * (LINK_GROUPS + 1) + group).x != 0.0;
}

bool is_blocked_by(int group, int role)
{
  return group == 0 || element(links, role * (LINK_GROUPS + 1) + group).y != 0.0;
}

/* Is there anything that light of the group passes? */
bool has_passage(int group)
{
  return element(links, group).z != 0.0;
}
#endif

struct Ray {
  vec3 origin;
  vec3 direction;
  vec3 inverse;
  ivec3 near_texel; /* texel of a node that holds the near plane of each axis */
  int axis;         /* largest component of the direction */
  vec3 shear;
};

struct Hit {
  float distance; /* NO_HIT where nothing was hit */
  int triangle;
  vec2 barycentric; /* weights of corners 1 and 2 */
};

vec3 permute(vec3 v, int axis)
{
  return axis == 0 ? v.yzx : axis == 1 ? v.zxy : v;
}

Ray make_ray(vec3 origin, vec3 direction)
{
  Ray ray;
  ray.origin = origin;
  ray.direction = direction;
  /* A component of zero becomes tiny: planes then lie far away instead of at 0·∞. */
  vec3 safe = mix(direction, vec3(1.0e-20), lessThan(abs(direction), vec3(1.0e-20)));
  ray.inverse = 1.0 / safe;
  ray.near_texel = ivec3(safe.x < 0.0 ? 3 : 0, safe.y < 0.0 ? 4 : 1, safe.z < 0.0 ? 5 : 2);
  vec3 size = abs(direction);
  ray.axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  vec3 d = permute(direction, ray.axis);
  ray.shear = vec3(d.xy, 1.0) / d.z;
  return ray;
}

/* Distance at which each of a node's four boxes is entered, NO_HIT where one is missed or lies beyond `limit`. */
vec4 enter_boxes(Ray ray, int node, float limit)
{
  int base = node * 7;
  ivec3 near = ray.near_texel;
  ivec3 far = ivec3(3, 5, 7) - near;
  vec4 entry = max(max((element(bvh_nodes, base + near.x) - ray.origin.x) * ray.inverse.x,
                       (element(bvh_nodes, base + near.y) - ray.origin.y) * ray.inverse.y),
                   max((element(bvh_nodes, base + near.z) - ray.origin.z) * ray.inverse.z, vec4(0.0)));
  vec4 leave = min(min((element(bvh_nodes, base + far.x) - ray.origin.x) * ray.inverse.x,
                       (element(bvh_nodes, base + far.y) - ray.origin.y) * ray.inverse.y),
                   min((element(bvh_nodes, base + far.z) - ray.origin.z) * ray.inverse.z, vec4(limit)));
  /* Ize, "Robust BVH Ray Traversal", JCGT 2013: two ulps keep rounding from opening seams. */
  leave *= 1.00000024;
  return mix(vec4(NO_HIT), entry, lessThanEqual(entry, leave));
}

/* Does the ray start on this triangle as far as float32 can tell? Corners far away are rounded so coarsely that a hit
 * point on a ground plane of a kilometre may lie beneath it, and a ray from there would find the plane again. a, b, c:
 * corners from the ray's origin. Where step_off already leaves the surface by more than that, nothing is ignored, so
 * rays cannot slip out at edges of rooms. */
bool starts_on(Ray ray, vec3 a, vec3 b, vec3 c)
{
  vec3 most = max(abs(a), max(abs(b), abs(c)));
  vec3 place = abs(ray.origin);
  float rounding = 5.0e-7 * max(most.x, max(most.y, most.z)) - STEP * max(place.x, max(place.y, place.z));
  return rounding > 0.0 && abs(dot(normalize(cross(b - a, c - a)), a)) < rounding;
}

/* Where a ray meets a triangle, nearer than `limit`: distance and weights of corners 1 and 2. */
bool meets(Ray ray, vec4 corner, vec4 corner1, vec4 corner2, float limit, out float distance, out vec2 barycentric)
{
  vec3 a = permute(corner.xyz - ray.origin, ray.axis);
  vec3 b = permute(corner1.xyz - ray.origin, ray.axis);
  vec3 c = permute(corner2.xyz - ray.origin, ray.axis);
  EXACT vec2 pa = a.xy - ray.shear.xy * a.z;
  EXACT vec2 pb = b.xy - ray.shear.xy * b.z;
  EXACT vec2 pc = c.xy - ray.shear.xy * c.z;
  EXACT float u = pc.x * pb.y - pc.y * pb.x;
  EXACT float v = pa.x * pc.y - pa.y * pc.x;
  EXACT float w = pb.x * pa.y - pb.y * pa.x;
  bool miss = min(u, min(v, w)) < 0.0 && max(u, max(v, w)) > 0.0;
  float determinant = u + v + w;
  if (miss || determinant == 0.0) {
    return false;
  }
  distance = (u * a.z + v * b.z + w * c.z) * ray.shear.z / determinant;
  barycentric = vec2(v, w) / determinant;
  return distance > 0.0 && distance < limit &&
         !starts_on(ray, corner.xyz - ray.origin, corner1.xyz - ray.origin, corner2.xyz - ray.origin);
}

/* Is the side of a triangle not there that looks against a ray, which runs along its normal so far? */
bool is_missing_side(int flags, float along_normal)
{
  return ((flags & UNSEEN_FROM_BEHIND) != 0 && along_normal > 0.0) ||
         ((flags & UNSEEN_FROM_FRONT) != 0 && along_normal < 0.0);
}

/* Does the ray pass a triangle because of its kind (`unseen`, as for intersect_triangle)? */
bool is_unseen(Ray ray, vec4 corner, vec4 corner1, vec4 corner2, int unseen)
{
#if defined(HAS_UNSEEN) || defined(HAS_LINKS)
  int flags = int(corner1.w);
#endif
#ifdef HAS_LINKS
  if (!is_blocked_by(unseen >> ROLE_SHIFT, flags >> ROLE_SHIFT)) {
    return true;
  }
#endif
#ifdef HAS_UNSEEN
  if ((flags & unseen) != 0 ||
      is_missing_side(flags, dot(cross(corner1.xyz - corner.xyz, corner2.xyz - corner.xyz), ray.direction))) {
    return true;
  }
#endif
  return false;
}

/* Tests triangle `index`; on a hit nearer than hit.distance replaces it. Returns true where its leaf ends. `unseen`:
 * the bit of triangles that the ray passes, and above ROLE_SHIFT the group of emitters that it goes to. */
bool intersect_triangle(Ray ray, int index, int unseen, inout Hit hit)
{
  vec4 corner = element(triangle_corners, 3 * index);
  vec4 corner1 = element(triangle_corners, 3 * index + 1);
  vec4 corner2 = element(triangle_corners, 3 * index + 2);
  float distance;
  vec2 barycentric;
  if (meets(ray, corner, corner1, corner2, hit.distance, distance, barycentric) &&
      !is_unseen(ray, corner, corner1, corner2, unseen)) {
#ifdef HAS_ALPHA
    if ((int(corner1.w) & CLIPPED) != 0 && is_hole(index, barycentric)) {
      return corner.w != 0.0;
    }
#endif
    hit.distance = distance;
    hit.triangle = index;
    hit.barycentric = barycentric;
  }
  return corner.w != 0.0;
}

#define ORDER(i, j) \
  if (entry[j] < entry[i]) { \
    float swap_entry = entry[i]; entry[i] = entry[j]; entry[j] = swap_entry; \
    float swap_child = child[i]; child[i] = child[j]; child[j] = swap_child; \
  }

/* Loops over a node's children are written out: where drivers are told to unroll nothing, indices that are not constant
 * would put vectors into memory. */
#ifdef LEAN_STACK
#  define KEEP_FOR_LATER(i) \
  if (entry[i] < NO_HIT) { \
    stack[top++] = int(child[i]); \
  }
#else
#  define KEEP_FOR_LATER(i) \
  if (entry[i] < NO_HIT) { \
    stack[top] = int(child[i]); \
    stack_entry[top] = entry[i]; \
    top++; \
  }
#endif

/* The nearest of what is left becomes `item`; without any the ray ends. With LEAN_STACK the stack does not know how far
 * away things are, and what lies behind the hit is found out when it is looked at: GPUs have stacks in memory and gain
 * by half the traffic, software drivers lose half their speed. */
#ifdef LEAN_STACK
#  define TAKE_NEXT \
  if (top == 0) { \
    return hit; \
  } \
  item = stack[--top];
#else
#  define TAKE_NEXT \
  do { \
    if (top == 0) { \
      return hit; \
    } \
    top--; \
  } while (stack_entry[top] > hit.distance); \
  item = stack[top];
#endif

/* The nearest hit closer than `limit`; triangle −1 and distance `limit` where there is none. */
Hit trace_nearest(vec3 origin, vec3 direction, float limit, int unseen)
{
  Ray ray = make_ray(origin, direction);
  Hit hit = Hit(limit, -1, vec2(0.0));
  int stack[STACK_SIZE];
#ifndef LEAN_STACK
  float stack_entry[STACK_SIZE];
#endif
  int top = 0;
  int item = 0;
  while (true) {
    while (item >= 0) {
      vec4 entry = enter_boxes(ray, item, hit.distance);
      vec4 child = element(bvh_nodes, item * 7 + 6);
      ORDER(0, 1) ORDER(2, 3) ORDER(0, 2) ORDER(1, 3) ORDER(1, 2)
      KEEP_FOR_LATER(3) KEEP_FOR_LATER(2) KEEP_FOR_LATER(1)
      if (entry[0] < NO_HIT) {
        item = int(child[0]);
      }
      else {
        TAKE_NEXT
      }
    }
    int index = -1 - item;
    while (!intersect_triangle(ray, index, unseen, hit)) {
      index++;
    }
    TAKE_NEXT
  }
}

Hit trace_within(vec3 origin, vec3 direction, float limit)
{
  return trace_nearest(origin, direction, limit, UNSEEN_BY_DIFFUSE_RAYS);
}

Hit trace_closest(vec3 origin, vec3 direction)
{
  return trace_within(origin, direction, NO_HIT);
}

/* What an eye sees. */
Hit trace_view(vec3 origin, vec3 direction)
{
  return trace_nearest(origin, direction, NO_HIT, UNSEEN_BY_CAMERA);
}

#define ENTER(i) \
  if (entry[i] < NO_HIT) { \
    if (item != NO_NODE) { \
      stack[top++] = item; \
    } \
    item = int(child[i]); \
  }

/* Down to a leaf, in any order; where nothing is left the function ends with `result`. */
#define GO_DOWN(result) \
  while (item >= 0) { \
    vec4 entry = enter_boxes(ray, item, limit); \
    vec4 child = element(bvh_nodes, item * 7 + 6); \
    item = NO_NODE; \
    ENTER(0) ENTER(1) ENTER(2) ENTER(3) \
    if (item == NO_NODE) { \
      if (top == 0) { \
        return result; \
      } \
      item = stack[--top]; \
    } \
  }

/* Is anything hit nearer than `limit` that does not have the bit `unseen`? */
bool trace_any_seen(vec3 origin, vec3 direction, float limit, int unseen)
{
  Ray ray = make_ray(origin, direction);
  Hit hit = Hit(limit, -1, vec2(0.0));
  int stack[STACK_SIZE];
  int top = 0;
  int item = 0;
  while (true) {
    GO_DOWN(false)
    int index = -1 - item;
    while (!intersect_triangle(ray, index, unseen, hit)) {
      index++;
    }
    if (hit.triangle >= 0) {
      return true;
    }
    if (top == 0) {
      return false;
    }
    item = stack[--top];
  }
}

/* Is anything hit nearer than `limit` that blocks light of a group of emitters? */
bool trace_blockers(vec3 origin, vec3 direction, float limit, int group)
{
  return trace_any_seen(origin, direction, limit, UNSEEN_BY_SHADOW_RAYS | (group << ROLE_SHIFT));
}

/* Is anything hit nearer than `limit`? */
bool trace_any(vec3 origin, vec3 direction, float limit)
{
  return trace_blockers(origin, direction, limit, 0);
}
