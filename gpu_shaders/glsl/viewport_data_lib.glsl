/* SPDX-License-Identifier: GPL-3.0-or-later */
/* What the preview shows of a field: probes, and data as colours. The same for the viewport, the render engine and
 * preview.png.
 *
 * shade_info: field's centre in the scene's frame, mode | factor of indirect light, specular reflectance, Phong
 *             exponent, 1 if probes show radiance instead of irradiance
 * node_marks, 1 element a node: validity, state, relative error of the cell that the node is the first corner of
 * Data modes return values that Standard display shows as meant: numbers of a display, linearised.
 */

const int FULL = 0, DIRECT = 1, INDIRECT = 2, IRRADIANCE = 3, NORMALS = 4, VALIDITY = 5, ERROR = 6;
const float FULL_SCALE_ERROR = 0.2; /* where the heat map ends */

int shade_mode()
{
  return int(shade_info[0].w);
}

/* Does the background belong to what is shown? */
bool shows_light()
{
  return shade_mode() <= INDIRECT;
}

vec3 display_to_linear(vec3 display)
{
  return mix(display / 12.92, pow((display + 0.055) / 1.055, vec3(2.4)), greaterThan(display, vec3(0.04045)));
}

#ifdef HAS_FIELD
/* Colour of a probe's state: green where it sees free space, towards orange the more back faces it sees, red where it
 * is invalid, blue where it is culled. */
vec3 state_color(int node)
{
  vec4 marks = element(node_marks, node);
  if (marks.y == 1.0) {
    return mix(vec3(0.95, 0.5, 0.05), vec3(0.2, 0.75, 0.3), clamp(marks.x, 0.0, 1.0));
  }
  return marks.y == 0.0 ? vec3(0.25, 0.35, 0.65) : vec3(0.8, 0.08, 0.1);
}

/* Dark blue, cyan, green, yellow, red over 0..1. */
vec3 heat_color(float heat)
{
  float x = clamp(heat, 0.0, 1.0) * 4.0;
  vec3 color = mix(vec3(0.08, 0.1, 0.45), vec3(0.1, 0.6, 0.85), clamp(x, 0.0, 1.0));
  color = mix(color, vec3(0.2, 0.75, 0.25), clamp(x - 1.0, 0.0, 1.0));
  color = mix(color, vec3(0.95, 0.85, 0.15), clamp(x - 2.0, 0.0, 1.0));
  return mix(color, vec3(0.85, 0.1, 0.08), clamp(x - 3.0, 0.0, 1.0));
}

/* A probe as a sphere. `mark`: its node, −1 where culled, −2 where invalid. */
vec3 shade_probe(int mark, vec3 normal)
{
  if (mark < 0) {
    return mark < -1 ? vec3(0.4, 0.02, 0.02) : vec3(0.05);
  }
  if (shade_mode() == VALIDITY) {
    return display_to_linear(state_color(mark));
  }
  if (shade_info[1].w == 0.0) {
    float transfer[COEFFICIENTS];
    sh_cosine_transfer(normal, transfer);
    return max(probe_irradiance(mark, transfer), vec3(0.0)) * 0.3183098861837907;
  }
  float basis[COEFFICIENTS];
  sh_basis(normal, basis);
  vec3 radiance = vec3(0.0);
  for (int i = 0; i < COEFFICIENTS; i++) {
    radiance += basis[i] * element(field_in, mark * COEFFICIENTS + i).rgb;
  }
  return max(radiance, vec3(0.0));
}
#endif
