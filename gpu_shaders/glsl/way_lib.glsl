/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Rays on their way from surface to surface. */

/* A ray that has met `surface`. */
struct Way {
  vec3 direction;
  Hit hit;
  Surface surface;
  vec3 throughput; /* 0 where nothing more can come */
  vec3 brought;
};

/* Where rays begin that leave the surface that was met. */
vec3 beginning(Way way)
{
  return step_off(way.surface.position, way.surface.normal, -way.direction, way.hit.distance);
}
