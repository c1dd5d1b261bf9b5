# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows: factors by which whole bands of a series are scaled, so that it rings less.

Formulas from Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC 2008, "Windowing". Engines apply one of these to all
probes alike; the window that costs least, probe by probe, is in core/ringing.py.
"""

from __future__ import annotations

import numpy as np

from .conventions import band_of
from .ringing import least_irradiance

_HALVINGS = 40
_MOST_STRENGTH = 1e3  # divides the second band by 4001: flat


def hann(bands: int, width: float) -> np.ndarray:
    """(bands,) factors ½ (1 + cos(π l / width)), 0 from ``width`` on."""
    l = np.arange(bands)
    return np.where(l < width, 0.5 * (1 + np.cos(np.pi * l / width)), 0.0)


def lanczos(bands: int, width: float) -> np.ndarray:
    """(bands,) factors sin(π l / width) / (π l / width), 0 from ``width`` on."""
    l = np.arange(bands)
    return np.where(l < width, np.sinc(l / width), 0.0)


def regularisation(bands: int, strength: float | np.ndarray) -> np.ndarray:
    """(…, bands) factors 1 / (1 + λ l²(l+1)²) for strengths λ (…): least squares with a penalty on the Laplacian."""
    l = np.arange(bands)
    return 1 / (1 + np.asarray(strength, float)[..., None] * (l * (l + 1.0)) ** 2)


def apply(coefficients: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """``coefficients`` (N, K, C) with every band scaled by ``factors`` (bands,) or (N, bands)."""
    factors = np.atleast_2d(factors)
    return coefficients * factors[:, [band_of(index) for index in range(coefficients.shape[1])], None]


def least_strength(coefficients: np.ndarray) -> np.ndarray:
    """(N,) least λ of ``regularisation`` under which no irradiance of radiance ``coefficients`` (N, K, 3) is negative;
    0 for probes that do not ring."""
    bands = int(round(np.sqrt(coefficients.shape[1])))

    def rings(strength):
        return (least_irradiance(apply(coefficients, regularisation(bands, strength))) < 0).any(axis=1)

    low = np.zeros(len(coefficients))
    high = np.where(rings(low), _MOST_STRENGTH, 0.0)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        bad = rings(middle)
        low, high = np.where(bad, middle, low), np.where(bad, high, middle)
    return high
