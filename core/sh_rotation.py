# SPDX-License-Identifier: GPL-3.0-or-later
"""Spherical harmonics under rotations and reflections of space."""

from __future__ import annotations

import numpy as np

from .conventions import bands_of
from .cubemap import texel_directions
from .spherical_harmonics import basis


def rotation(matrix: np.ndarray, bands: int) -> np.ndarray:
    """(bands², bands²) matrix that turns coefficients of L(d) into those of L(matrixᵀ d).

    ``matrix`` (3, 3) is orthogonal, of either handedness: light that came from d then comes from matrix·d. Found by
    evaluating the turned basis at more directions than it has functions and solving for the coefficients; every band is
    closed under ``matrix``, so the solution is exact to rounding.
    """
    directions = texel_directions(4).reshape(-1, 3)
    found = np.linalg.lstsq(basis(directions, bands), basis(directions @ matrix, bands), rcond=None)[0]
    return np.where(np.abs(found) < 1e-13, 0.0, found)


def rotate(coefficients: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """``coefficients`` (…, bands², C) of the light as it is after space was turned by ``matrix`` (3, 3); float64."""
    bands = bands_of(coefficients.shape[-2])
    return np.einsum("kj,...jc->...kc", rotation(matrix, bands), coefficients, optimize=True)
