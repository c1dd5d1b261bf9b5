/* SPDX-License-Identifier: GPL-3.0-or-later */
/* Highlights: what faint gloss makes of light that arrives from one direction instead of sending it evenly. Reference:
 * core/highlights.py. */

struct FaintGloss {
  Gloss gloss;
  vec3 slope; /* k, see core/faint_gloss.py */
  float power;
};

FaintGloss faint_gloss_of(int material)
{
  int first = 3 * material;
  vec4 share = element(faint_gloss, first), slope = element(faint_gloss, first + 1);
  vec4 facing = element(faint_gloss, first + 2);
  return FaintGloss(Gloss(share.rgb, facing.w, facing.rgb, slope.w != 0.0), slope.rgb, share.w);
}

/* What of it is mirrored on average by facets seen, or lit, at this cosine. */
vec3 faintly_mirrored(FaintGloss faint, vec3 whole, float cosine)
{
  float grazing = pow(clamp(1.0 - cosine, 0.0, 1.0), faint.power) - 2.0 / ((faint.power + 1.0) * (faint.power + 2.0));
  return min(whole * (1.0 + faint.slope * grazing), vec3(1.0));
}

/* What is sent to a view at this cosine of light from everywhere. */
vec3 albedo_at(FaintGloss faint, vec3 mean_albedo, float cosine)
{
  vec3 whole = mirrored_in_all(faint.gloss, mean_albedo), mirrored = faintly_mirrored(faint, whole, cosine);
  return mirrored + (mean_albedo - whole) * (1.0 - mirrored) / max(1.0 - whole, vec3(1.0e-3));
}

/* Radiance that a lobe of this `width` sends to `view` beyond what is sent there evenly, for each unit of irradiance
 * that arrives from `towards` and counts by the surface's coupling. */
vec3 highlight(FaintGloss faint, Surface surface, vec3 view, vec3 towards, float width)
{
  float arriving = dot(towards, surface.normal);
  if (arriving <= 0.0) {
    return vec3(0.0);
  }
  surface.albedo = surface.mean_albedo;
  float leaving = dot(view, surface.normal);
  vec3 mirrored = faintly_mirrored(faint, mirrored_in_all(faint.gloss, surface.albedo), leaving);
  vec3 evenly = albedo_at(faint, surface.albedo, leaving);
  coupling = surface.coupling;
  vec3 counts = coupled(arriving);
  vec3 replaced = evenly * counts - (evenly - mirrored);
  return (gloss_lobe(faint.gloss, surface, view, towards, width) / arriving - replaced * 0.3183098861837907) / counts;
}
