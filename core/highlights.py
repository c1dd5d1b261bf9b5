# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights: the images of lamps in gloss that is not followed.

Such gloss is sent in all directions (core/faint_gloss.py); but of light that arrives from few directions it makes a
highlight, and a probe above a floor of plastic sees what it gets of a lamp overhead near the lamp's mirror image. Of
light from the angle θ a surface sends to a view at θ', by facets or diffusely beside them, for each unit of irradiance

    lobe (core/gloss.py) + D(θ')/π,    D(θ') = (A − S)(1 − F(θ'))/(1 − S),

and A(θ')·C(θ)/π is what is sent evenly: the lobe takes the place of A(θ')·C(θ) − D(θ'). Both are F(θ) over all views,
and F(θ') under light from everywhere, so no light is lost or made. The light is that of a patch, its shadows with it,
part by part: each lamp, and all sampled emitters. So nothing but texels has to look, and they need no ray.

A look counts by what would arrive if nothing stood between; one that sees much less of a lamp than the patch as a whole
shows less of it, or a single look at the far end of a tube beside a wall would make a blaze of all its light.

Readable twin of gpu_shaders/glsl/highlight_lib.glsl and highlight_project_comp.glsl. N places.
"""

from __future__ import annotations

import numpy as np

from .faint_gloss import albedo_towards, coupled, couplings, mirrored_at
from .gloss import GlossyPlaces

LAMP_LOOKS, EMITTER_LOOKS = 2, 4  # of a texel, at each part of the light, but
MOST_LOOKS = 16  # where one of them finds a lobe that is narrow against the texel
# Narrow is a lobe of which SHARP widths are less than its facets turn within the texel; it counts up to NEAR_PEAK times
# both of them away from its peak. At grazing angles most highlights are narrower than texels.
SHARP, NEAR_PEAK = 0.5, 3.0
# Least width of lobes, against how far facets that mirror one way turn from one side of a texel to the other: probes
# see all texels together, so a lobe may be as wide as one.
HIGHLIGHT_BLUR = 1.0
LEAST_SEEN = 0.25  # of what a patch as a whole gets of a lamp: looks that see less of it show less of it
HIGHLIGHT_STREAM = 0x5851F42D


def highlights(rows, albedo, normal, view, towards, width) -> np.ndarray:
    """(N, 3) radiance that lobes of ``width`` α (N,) send to ``view`` (N, 3) beyond what is sent there evenly, for each
    unit of irradiance that arrives from ``towards`` (N, 3) and counts by the coupling. ``rows`` (N, 3, 4) of
    ``faint_rows``, mean ``albedo`` (N, 3), ``normal`` (N, 3)."""
    lobes = np.stack(
        [np.concatenate([rows[:, 0, :3], rows[:, 2, 3:]], 1), np.concatenate([rows[:, 2, :3], rows[:, 1, 3:]], 1)], 1
    )
    arriving = np.einsum("ni,ni->n", towards, normal)
    leaving = np.einsum("ni,ni->n", view, normal)
    lit = np.where(arriving > 0, arriving, 1.0)
    sent = GlossyPlaces(lobes, albedo, normal, normal, view).lobe(towards, width) / lit[:, None]
    counts, evenly = coupled(couplings(rows, albedo), lit), albedo_towards(rows, albedo, leaving)
    replaced = evenly * counts - (evenly - mirrored_at(rows, albedo, leaving))
    result = (sent - replaced / np.pi) / counts
    return np.where(arriving[:, None] > 0, result, 0.0)


def sharp(normal, view, towards, width, turn) -> np.ndarray:
    """(N,) bool: within what is looked at, a highlight of ``width`` (N,) may change much, as facets that mirror one way
    and are seen face on ``turn`` (N,) radians from one side of it to the other, and the more the more the view
    slants."""
    middle = view + towards
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-20)
    height = np.maximum(np.einsum("ni,ni->n", middle, normal), 1e-4)
    turns = turn / np.maximum(np.einsum("ni,ni->n", view, middle), 1e-3)
    slope = np.sqrt(np.maximum(1 - height**2, 0.0)) / height
    return (turns > SHARP * width) & (slope < NEAR_PEAK * (width + turns))
