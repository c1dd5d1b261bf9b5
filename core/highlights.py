# SPDX-License-Identifier: GPL-3.0-or-later
"""Highlights: the images of lamps in gloss that is not followed.

Such gloss is sent in all directions (core/faint_gloss.py); but of light that arrives from few directions it makes a
highlight, and a probe above a floor of plastic sees what it gets of a lamp overhead near the lamp's mirror image. Of
light from the angle θ, facets that are seen at θ' send evenly

    F(θ')·F(θ) / (π·S)

in place of what the lobe sends (core/gloss.py); both are F(θ) over all views, so no light is lost or made. The light is
that of a patch, its shadows with it, part by part: each lamp, and all sampled emitters. So nothing but texels has to
look, and they need no ray.

A look counts by what would arrive if nothing stood between; one that sees much less of a lamp than the patch as a whole
shows less of it, or a single look at the far end of a tube beside a wall would make a blaze of all its light.

Readable twin of gpu_shaders/glsl/highlight_lib.glsl and highlight_project_comp.glsl. N places.
"""

from __future__ import annotations

import numpy as np

from .faint_gloss import coupled, couplings, mirrored_at
from .gloss import GlossyPlaces

LAMP_LOOKS, EMITTER_LOOKS = 2, 4  # of a texel, at each part of the light
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
    seen, taken, whole = (mirrored_at(rows, albedo, cosine) for cosine in (leaving, lit, None))
    result = (sent - seen * taken / (np.pi * np.maximum(whole, 1e-9))) / coupled(couplings(rows, albedo), lit)
    return np.where(arriving[:, None] > 0, result, 0.0)
