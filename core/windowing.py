# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows: factors by which whole bands of a series are scaled, so that it rings less.

Formulas from Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC 2008, "Windowing". Engines apply one of these to all
probes alike; the window that costs least, probe by probe, is in core/ringing.py.
"""

from __future__ import annotations

import numpy as np

from .conventions import band_of


def hann(bands: int, width: float) -> np.ndarray:
    """(bands,) factors ½ (1 + cos(π l / width)), 0 from ``width`` on."""
    l = np.arange(bands)
    return np.where(l < width, 0.5 * (1 + np.cos(np.pi * l / width)), 0.0)


def lanczos(bands: int, width: float) -> np.ndarray:
    """(bands,) factors sin(π l / width) / (π l / width), 0 from ``width`` on."""
    l = np.arange(bands)
    return np.where(l < width, np.sinc(l / width), 0.0)


def apply(coefficients: np.ndarray, factors: np.ndarray) -> np.ndarray:
    """``coefficients`` (N, K, C) with every band scaled by ``factors`` (bands,) or (N, bands)."""
    factors = np.atleast_2d(factors)
    return coefficients * factors[:, [band_of(index) for index in range(coefficients.shape[1])], None]
