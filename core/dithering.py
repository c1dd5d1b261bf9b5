# SPDX-License-Identifier: GPL-3.0-or-later
"""Partial transparency as a fixed pattern of holes: the readable twin of ``dither_threshold`` in surface_lib.glsl.

Every triangle is cut into cells by its barycentric coordinates. A cell is a hole where its own random threshold is
above the alpha there, so a surface lets 1 − alpha of the light through, whichever ray asks, and the same light on both
ways of capture and in every relight.
"""

from __future__ import annotations

import numpy as np

CELLS = 256  # along a triangle's edge

_FACTORS = np.array([0x9E3779B1, 0x85EBCA6B, 0xC2B2AE35], np.uint32)


def dither_threshold(triangle: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """(N,) thresholds in 0..1 at ``barycentric`` (N, 2) of ``triangle`` (N,), numbers in the snapshot.

    Hash: Wellons' "lowbias32" over the three numbers.
    """
    cell = np.floor(np.clip(barycentric, 0, 1) * CELLS).astype(np.uint32)
    key = np.stack([triangle.astype(np.uint32), cell[:, 0], cell[:, 1]], axis=1)
    with np.errstate(over="ignore"):
        mixed = np.bitwise_xor.reduce(key * _FACTORS, axis=1)
        for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
            mixed = (mixed ^ (mixed >> np.uint32(shift))) * np.uint32(factor)
        mixed ^= mixed >> np.uint32(16)
    return ((mixed >> np.uint32(8)) + 0.5) / (1 << 24)
