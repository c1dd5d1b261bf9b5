/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Reading the field: SH of the probes in `field_in`, COEFFICIENTS elements a node, and in `gradient_in` how much they
 * change over one cell along each axis, 3 · TRANSFER_COEFFICIENTS elements a node, axis by axis. Needs
 * spherical_harmonics_lib; grid_info as in lookup_lib. Reference: core/lookup.py.
 */

vec3 coefficient_at(int node, int index, vec3 step)
{
  vec3 value = element(field_in, node * COEFFICIENTS + index).rgb;
  for (int axis = 0; axis < 3; axis++) {
    if (step[axis] != 0.0) {
      value += step[axis] * element(gradient_in, (node * 3 + axis) * TRANSFER_COEFFICIENTS + index).rgb;
    }
  }
  return value;
}

/* Irradiance at `normal` of the field, blended over the corners of a cell, each led to the point by its gradient: see
 * lookup_cell. May be negative where the series rings. */
vec3 field_irradiance(int first_node, vec4 weights0, vec4 weights1, vec4 lead, vec3 normal)
{
  ivec3 resolution = ivec3(grid_info[3].xyz);
  float transfer[COEFFICIENTS];
  sh_cosine_transfer(normal, transfer);
  vec3 sum = vec3(0.0);
  for (int corner = 0; corner < 8; corner++) {
    float weight = corner < 4 ? weights0[corner] : weights1[corner - 4];
    if (weight > 0.0) {
      ivec3 corner_step = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
      int node = first_node + corner_step.x + resolution.x * (corner_step.y + resolution.y * corner_step.z);
      vec3 step = lead.w * (lead.xyz - 0.5 * vec3(corner_step));
      vec3 value = vec3(0.0);
      for (int i = 0; i < TRANSFER_COEFFICIENTS; i++) {
        value += transfer[i] * coefficient_at(node, i, step);
      }
      sum += weight * value;
    }
  }
  return sum;
}
