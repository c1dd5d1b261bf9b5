/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reading the field: SH of the probes in `field_in`, COEFFICIENTS elements a node, and in `gradient_in` how much they
 * change over one cell along each axis, 3 · TRANSFER_COEFFICIENTS elements a node, axis by axis. Needs
 * lookup_lib and spherical_harmonics_lib. Reference: core/lookup.py.
 */

/* Irradiance of the probe at `node` for the surface that `transfer` is of. */
vec3 probe_irradiance(int node, float transfer[COEFFICIENTS])
{
  vec3 sum = vec3(0.0);
  for (int i = 0; i < TRANSFER_COEFFICIENTS; i++) {
    sum += transfer[i] * element(field_in, node * COEFFICIENTS + i).rgb;
  }
  return sum;
}

/* How much that changes `step` cells away. */
vec3 irradiance_change(int node, vec3 step, float transfer[COEFFICIENTS])
{
  vec3 sum = vec3(0.0);
  for (int axis = 0; axis < 3; axis++) {
    if (step[axis] != 0.0) {
      for (int i = 0; i < TRANSFER_COEFFICIENTS; i++) {
        sum += step[axis] * transfer[i] * element(gradient_in, (node * 3 + axis) * TRANSFER_COEFFICIENTS + i).rgb;
      }
    }
  }
  return sum;
}

/* Irradiance at `point` with `normal` of the field, blended over the corners of its cell, each led to the point by its
 * gradient; where they see too little, also over the nodes around the cell. May be negative where the series rings. */
vec3 field_irradiance(vec3 point, vec3 normal)
{
  vec3 beyond;
  vec3 lattice = lattice_position(point, beyond);
  ivec3 cell = first_corner(lattice);
  vec3 blend = lattice - vec3(cell);
  vec3 border = floor(blend + 0.5);
  blend = mix(blend, border, lessThan(abs(blend - border), vec3(ON_BORDER)));
  float transfer[COEFFICIENTS];
  sh_cosine_transfer(normal, transfer);
  ivec3 last = ivec3(grid_info[3].xyz) - 1;
  float weights[8];
  float sum = 0.0, around = 0.0, most = 0.0;
  vec3 value = vec3(0.0), rest = vec3(0.0);
  for (int item = 0; item < 8 + 64; item++) {
    if (item == 8) {
      around = AROUND_WEIGHT * (1.0 - sum / SEEN_ENOUGH);
      if (around <= 0.0 || most >= 1.0) {
        break; /* a node's light is its own */
      }
    }
    ivec3 step = lookup_step(item);
    ivec3 node = cell + step;
    float weight;
    if (item < 8) {
      vec3 part = mix(1.0 - blend, blend, vec3(step));
      weight = part.x * part.y * part.z;
      most = max(most, weight);
      weights[item] = 0.0;
    }
    else {
      vec3 apart = blend - vec3(step);
      float squared = dot(apart, apart);
      bool asked = !is_corner(step) && all(greaterThanEqual(node, ivec3(0))) && all(lessThanEqual(node, last));
      weight = asked ? around / (squared * squared) : 0.0;
    }
    if (weight > 0.0) {
      int index = node_index(node);
      vec4 place = element(grid_nodes, index);
      if (item >= 8 && (place.w < 0.0 || FARTHEST * distance(place.xyz, point) > grid_info[3].w)) {
        continue; /* knows nothing of it */
      }
      weight *= seen_weight(place, point, normal);
      sum += weight;
      value += weight * probe_irradiance(index, transfer);
      if (item < 8) {
        weights[item] = weight;
        rest += weight * 0.5 * (blend - vec3(step));
      }
    }
  }
  /* Half of the way from where the blend of what is left is to the point, besides half of that from each node. */
  vec3 lead = rest / sum + 0.5 * blend + clamp(beyond, -BEYOND, BEYOND);
  for (int corner = 0; corner < 8; corner++) {
    if (weights[corner] > 0.0) {
      ivec3 step = lookup_step(corner);
      vec3 way = clamp(lead - 0.5 * vec3(step), -BEYOND, BEYOND);
      value += weights[corner] * irradiance_change(node_index(cell + step), way, transfer);
    }
  }
  return value / sum;
}
