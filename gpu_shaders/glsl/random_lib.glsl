/* Seeded numbers that depend on what is sampled and on nothing else, so that any split of the work gives the same bytes.
 * Hash: Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 2020 (pcg3d). Sequence: Roberts' R2, two-dimensional
 * low discrepancy, rotated by the hash (Cranley and Patterson 1976). Reference: core/sampling.py.
 */

uvec3 pcg3d(uvec3 v)
{
  v = v * 1664525u + 1013904223u;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  v ^= v >> 16u;
  v.x += v.y * v.z;
  v.y += v.z * v.x;
  v.z += v.x * v.y;
  return v;
}

/* Two numbers in [0, 1): sample `index` of the sequence that belongs to `key`. In integers, whose overflow is the sequence's
 * modulo 1: exact for any index, the same on every driver. */
vec2 sample_r2(uvec3 key, int index)
{
  uvec2 place = pcg3d(key).xy + uvec2(3242174889u, 2447445414u) * uint(index);
  return vec2(place >> 8u) * (1.0 / 16777216.0);
}
