/* Reading the field: SH of the probes in `field_in`, COEFFICIENTS elements a node. Needs spherical_harmonics_lib; grid_info as in
 * lookup_lib. Reference: core/lookup.py.
 */

/* Irradiance at `normal` of the field in `field_in`, blended over the corners of a cell. May be negative where the series rings. */
vec3 field_irradiance(int first_node, vec4 weights0, vec4 weights1, vec3 normal)
{
  ivec3 resolution = ivec3(grid_info[3].xyz);
  float transfer[COEFFICIENTS];
  sh_cosine_transfer(normal, transfer);
  vec3 sum = vec3(0.0);
  for (int corner = 0; corner < 8; corner++) {
    float weight = corner < 4 ? weights0[corner] : weights1[corner - 4];
    if (weight > 0.0) {
      int node = first_node + (corner & 1) +
                 resolution.x * (((corner >> 1) & 1) + resolution.y * (corner >> 2));
      vec3 value = vec3(0.0);
      for (int i = 0; i < TRANSFER_COEFFICIENTS; i++) {
        value += transfer[i] * element(field_in, node * COEFFICIENTS + i).rgb;
      }
      sum += weight * value;
    }
  }
  return sum;
}
