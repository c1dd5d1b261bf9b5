/* SPDX-License-Identifier: GPL-3.0-or-later */
/* The finished view, fragment stage: mean of the samples, exposure, tone curve, and the depth of the first sample.
 *
 * Pictures may be coarser than the screen. Their pixels then lie nearer or farther than the middle of their texel, and
 * what Blender drew of the same surface must not win over half of them: the nearest depth around counts.
 *
 * Encodings: SCENE_LINEAR for render engines, whose view transform Blender applies; OVERLAY for draw handlers, whose
 * picture Blender merges with the scene's in a space where a display is a power of 2.2, whatever its view transform;
 * DISPLAY for plain 8-bit images.
 * Tone curves: STANDARD is Blender's view of that name: exposure, clip, sRGB curve (IEC 61966-2-1), gamma. FILMIC rolls
 * highlights off: Hable, "Filmic Tonemapping Operators", 2010, white at 11.2. LINEAR shows the numbers themselves,
 * without the sRGB curve.
 */

const int SCENE_LINEAR = 0, OVERLAY = 1, DISPLAY = 2;
const int STANDARD = 0, FILMIC = 1, LINEAR = 2;

vec3 linear_to_display(vec3 value)
{
  return mix(12.92 * value, 1.055 * pow(value, vec3(1.0 / 2.4)) - 0.055, greaterThan(value, vec3(0.0031308)));
}

vec3 shoulder(vec3 x)
{
  return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
}

float depth_around(ivec2 texel)
{
  float depth = texelFetch(picture_depth, texel, 0).r;
  ivec2 last = textureSize(picture_depth, 0) - 1;
  bool is_coarse = fwidth(place.x) * float(last.x + 1) < 0.75;
  if (!is_coarse || depth >= 1.0) {
    return depth;
  }
  for (int y = -1; y <= 1; y++) {
    for (int x = -1; x <= 1; x++) {
      depth = min(depth, texelFetch(picture_depth, clamp(texel + ivec2(x, y), ivec2(0), last), 0).r);
    }
  }
  return depth;
}

void main()
{
  ivec2 texel = min(ivec2(place * vec2(textureSize(picture, 0))), textureSize(picture, 0) - 1);
  vec4 sum = texelFetch(picture, texel, 0);
  if (sum.a <= 0.0) {
    discard;
  }
  float coverage = min(sum.a / float(sample_count), 1.0);
  vec3 color = sum.rgb / sum.a;
  if (encoding != SCENE_LINEAR) {
    color = max(color, vec3(0.0)) * exp2(exposure);
    if (tone_curve == FILMIC) {
      color = shoulder(2.0 * color) / shoulder(vec3(11.2));
    }
    color = clamp(color, vec3(0.0), vec3(1.0));
    vec3 display = tone_curve == LINEAR ? color : linear_to_display(color);
    display = pow(display, vec3(1.0 / gamma));
    color = encoding == OVERLAY ? pow(display, vec3(2.2)) : display;
  }
  frag_color = vec4(color * coverage, coverage);
  float depth = depth_around(texel);
  /* Toward the eye by a share of the distance, so that a surface that Blender drew at the same place does not win by
   * rounding. */
  gl_FragDepth = depth < 1.0 ? clamp(depth_scale_offset.x * depth + depth_scale_offset.y, 0.0, 1.0) : 1.0;
}
