# SPDX-License-Identifier: GPL-3.0-or-later
"""The last step of a bake where it is asked for: a window for probes whose irradiance falls below zero."""

from __future__ import annotations

import numpy as np

from ..core.field import Field
from ..core.ringing import band_factors, dering


def dering_field(field: Field) -> str:
    """Windows ``field`` where it rings; returns what to say about it."""
    window = dering(field.coefficients)
    field.coefficients = window.coefficients
    factors = band_factors(window.factors, field.bands)[:, None, : field.gradient.shape[2], None]
    field.gradient = (field.gradient * factors).astype(np.float32)
    done = window.as_dict()
    return (
        f"deringing: {done['windowed']} of {done['probes']} probes flattened, the strongest to "
        f"{done['least_factor']:.2f} of its contrast; irradiance changed by {100 * window.damage:.2g} % of its RMS"
    )
