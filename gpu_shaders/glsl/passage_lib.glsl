/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What comes along rays: all light where nothing is hit, but for what coloured holes (HAS_TINT) take of it. */

#ifdef HAS_TINT
/* What a ray that is of the kind `unseen` brings along of light from `limit` away: what coloured holes leave, and where
 * it may be `stopped`, nothing where it hits anything nearer. A ray that is known to hit nothing nearer must not be
 * asked again: drivers round each copy of this code in their own way, and it would be stopped by what it has hit. */
vec3 passage(vec3 origin, vec3 direction, float limit, int unseen, bool stopped)
{
  Ray ray = make_ray(origin, direction);
  vec3 tint = vec3(1.0);
  int stack[STACK_SIZE];
  int top = 0;
  int item = 0;
  while (true) {
    GO_DOWN(tint)
    int index = -1 - item;
    bool ends = false, blocks = false;
    while (!ends && !blocks) {
      vec4 corner = element(triangle_corners, 3 * index);
      vec4 corner1 = element(triangle_corners, 3 * index + 1);
      vec4 corner2 = element(triangle_corners, 3 * index + 2);
      float distance;
      vec2 barycentric;
      int flags = int(corner1.w);
      if ((stopped || (flags & TINTED) != 0) && meets(ray, corner, corner1, corner2, limit, distance, barycentric) &&
          !is_unseen(ray, corner, corner1, corner2, unseen)) {
        bool passes = (flags & CLIPPED) != 0 && is_hole(index, barycentric);
        if (passes && (flags & TINTED) != 0) {
          tint *= hole_tint(index, barycentric);
        }
        blocks = stopped && !passes;
      }
      ends = corner.w != 0.0;
      index++;
    }
    if (blocks) {
      return vec3(0.0);
    }
    if (top == 0) {
      return tint;
    }
    item = stack[--top];
  }
}
#endif

/* What arrives of light that nothing else hits along a ray as far as `limit`: all, but for coloured holes. */
vec3 passed_to(vec3 origin, vec3 direction, float limit)
{
#ifdef HAS_TINT
  return passage(origin, direction, limit, UNSEEN_BY_DIFFUSE_RAYS, false);
#else
  return vec3(1.0);
#endif
}

/* What arrives along a ray to an emitter of a group of light linking, `limit` away. */
vec3 light_along(vec3 origin, vec3 direction, float limit, int group)
{
#ifdef HAS_TINT
  return passage(origin, direction, limit, UNSEEN_BY_SHADOW_RAYS | (group << ROLE_SHIFT), true);
#else
  return trace_blockers(origin, direction, limit, group) ? vec3(0.0) : vec3(1.0);
#endif
}

/* A ray to a light, and what comes along it if nothing stands between. */
struct ShadowRay {
  vec3 origin;
  vec3 direction;
  float limit; /* 0 to lights without shadows */
  int group;   /* of light linking; 0 without HAS_LINKS */
  vec3 brings;
};

const ShadowRay NO_SHADOW_RAY = ShadowRay(vec3(0.0), vec3(0.0, 0.0, 1.0), 0.0, 0, vec3(0.0));

/* What comes along it. */
vec3 brought_by(ShadowRay ray)
{
  bool asks = ray.limit > 0.0 && ray.brings != vec3(0.0);
  return asks ? ray.brings * light_along(ray.origin, ray.direction, ray.limit, ray.group) : ray.brings;
}
