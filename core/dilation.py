# SPDX-License-Identifier: GPL-3.0-or-later
"""Light for the probes that have none of their own: culled ones and those inside solids."""

from __future__ import annotations

import numpy as np

from .grid import Grid

_SWEEPS = 64


def fill(grid: Grid, coefficients: np.ndarray, active: np.ndarray) -> np.ndarray:
    """Coefficients (P, K, 3) with inactive nodes filled from the active ones, ``active`` (P,) bool.

    Filled nodes solve Laplace's equation between active ones (each the mean of its neighbours along the axes): the
    smoothest light that agrees with what was baked. Without any active node everything stays as it is.
    """
    if active.all() or not active.any():
        return coefficients
    filled = coefficients.astype(np.float64)
    missing = np.flatnonzero(~active)
    known = active.copy()
    around = neighbours(grid, missing)
    while not known.all():  # first guess: layer by layer from what is known
        weights = _usable(around, known)
        ready = weights.any(axis=1) & ~known[missing]
        filled[missing[ready]] = _mean(filled, around[ready], weights[ready])
        known[missing[ready]] = True
    weights = around >= 0
    for _ in range(_SWEEPS):
        filled[missing] = _mean(filled, around, weights)
    return filled.astype(coefficients.dtype)


def neighbours(grid: Grid, nodes: np.ndarray) -> np.ndarray:
    """(N, 6) flat indices of the nodes one step along each axis, −1 past the edge."""
    resolution = np.array(grid.resolution)
    strides = np.array([1, resolution[0], resolution[0] * resolution[1]])
    lattice = nodes[:, None] // strides % resolution
    columns = []
    for axis in range(3):
        for step in (-1, 1):
            at = lattice[:, axis] + step
            columns.append(np.where((at >= 0) & (at < resolution[axis]), nodes + step * strides[axis], -1))
    return np.stack(columns, axis=1)


def _usable(neighbours: np.ndarray, known: np.ndarray) -> np.ndarray:
    return (neighbours >= 0) & known[neighbours]


def _mean(values: np.ndarray, neighbours: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Mean of ``values`` (P, K, 3) over ``neighbours`` (N, 6) where ``weights`` (N, 6) is true."""
    total = (values[neighbours] * weights[:, :, None, None]).sum(axis=1)
    return total / weights.sum(axis=1)[:, None, None]
