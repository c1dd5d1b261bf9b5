/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Seeded numbers that depend on what is sampled and on nothing else, so that any split of the work gives the same
 * bytes.
 * Hash: Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 2020 (pcg3d). Sequence: Roberts' R2,
 * two-dimensional low discrepancy, rotated by the hash (Cranley and Patterson 1976). Reference: core/sampling.py.
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

/* Two numbers in [0, 1): sample `index` of the sequence that belongs to `key`. In integers, whose overflow is the
 * sequence's modulo 1: exact for any index, the same on every driver. */
vec2 sample_r2(uvec3 key, int index)
{
  uvec2 place = pcg3d(key).xy + uvec2(3242174889u, 2447445414u) * uint(index);
  return vec2(place >> 8u) * (1.0 / 16777216.0);
}

/* Three numbers in [0, 1) by the same rule from the three-dimensional sequence. */
vec3 sample_r3(uvec3 key, int index)
{
  uvec3 place = pcg3d(key) + uvec3(3518319155u, 2882110345u, 2360945575u) * uint(index);
  return vec3(place >> 8u) * (1.0 / 16777216.0);
}

/* One of several in proportion to weights that come one after the other: does the choice move on to this one? A single
 * `number` chooses, what is left of it is spread over 0..1 again; `total`: of the weights so far. */
bool takes(float weight, inout float number, inout float total)
{
  total += weight;
  if (weight > 0.0 && number * total < weight) {
    number = number * total / weight;
    return true;
  }
  if (total > weight) {
    number = (number * total - weight) / (total - weight);
  }
  return false;
}

vec2 sample_disk(vec2 u)
{
  float r = sqrt(u.x), phi = 6.283185307179586 * u.y;
  return r * vec2(cos(phi), sin(phi));
}

/* Two unit vectors perpendicular to n: Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017. */
void tangent_frame(vec3 n, out vec3 t, out vec3 b)
{
  float s = n.z >= 0.0 ? 1.0 : -1.0;
  float a = -1.0 / (s + n.z);
  float c = n.x * n.y * a;
  t = vec3(1.0 + s * n.x * n.x * a, s * c, -s * n.x);
  b = vec3(c, s + n.y * n.y * a, -n.y);
}

/* Direction with density cos/π about the normal (Malley's method). */
vec3 sample_cosine(vec3 normal, vec2 u)
{
  vec3 t, b;
  tangent_frame(normal, t, b);
  vec2 disk = sample_disk(u);
  return normalize(disk.x * t + disk.y * b + sqrt(max(1.0 - u.x, 0.0)) * normal);
}
