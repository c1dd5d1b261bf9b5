# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a grid is too coarse for its light, told from the field alone.

The lookup follows gradients and so reproduces light that is quadratic in space. What is left shows where two probes
disagree about the middle of the edge between them: each one's light plus its gradient for half a cell,

    D = (c₀ + ½ g₀) − (c₁ − ½ g₁)

which is zero for quadratic light and h³/12 times the third derivative beyond, where the lookup errs by 0.069 D (RMS
over the edge); where light jumps within a cell D is the jump and the lookup errs by up to half of it. The share in
between that is used here was measured (docs/history.md, "What `--error` learned").

Fields without gradients are interpolated linearly, which is off by at most h²/8 times the second derivative: an eighth
of the second difference of three probes in a row.

Neither knows about errors of the probes themselves.
"""

from __future__ import annotations

import numpy as np

from .conventions import ACTIVE
from .field import Field
from .gradients import per_cell
from .spherical_harmonics import cosine_lobe

_OF_DISAGREEMENT = 0.2
_OF_SECOND_DIFFERENCE = 1.0 / 8.0


def interpolation_error(field: Field) -> np.ndarray:
    """(P,) float32 relative error of irradiance in the cell whose first corner is the node; 0 where nothing is known.

    Nodes at the far ends of an axis hold what the last cell before them does. Probes that are culled or invalid carry
    their neighbours' light and tell nothing.
    """
    nx, ny, nz = field.grid.resolution
    lobe = cosine_lobe(field.bands)
    light = (field.coefficients * lobe[:, None]).reshape(nz, ny, nx, -1)
    active = (field.state == ACTIVE).reshape(nz, ny, nx)
    squared = np.zeros((nz, ny, nx))
    if field.gradient.any():
        known = field.gradient.shape[2]
        change = np.zeros((field.grid.count, 3, *field.coefficients.shape[1:]))
        change[:, :, :known] = per_cell(field.grid, field.gradient) * lobe[:known, None]
        for axis in range(3):
            along = change[:, 2 - axis].reshape(light.shape)  # arrays here are ordered z, y, x
            squared += (_OF_DISAGREEMENT * _disagreement(light, along, active, axis)) ** 2
    else:
        for axis in range(3):
            squared += (_OF_SECOND_DIFFERENCE * _second_difference(light, active, axis)) ** 2
    strength = np.linalg.norm(light, axis=-1)
    # In the dark a share of nearly nothing would be a large error that nobody sees.
    floor = 0.05 * strength[active].mean() if active.any() else 0.0
    share = np.sqrt(squared) / np.maximum(np.maximum(strength, floor), 1e-30)
    return _cell_means(share, active).reshape(-1).astype(np.float32)


def _disagreement(light: np.ndarray, change: np.ndarray, active: np.ndarray, axis: int) -> np.ndarray:
    """Norm of what two neighbours along ``axis`` differ by about the middle between them, RMS over the edges at every
    node; 0 where none is known. ``change``: of ``light`` over one cell along the axis."""
    total, edges = np.zeros(active.shape), np.zeros(active.shape)
    count = active.shape[axis]
    if count < 2:
        return total
    first, second = _part(axis, slice(0, count - 1)), _part(axis, slice(1, count))
    difference = light[first] + 0.5 * change[first] - light[second] + 0.5 * change[second]
    known = active[first] & active[second]
    for end in (first, second):
        total[end] += np.where(known, (difference**2).sum(axis=-1), 0.0)
        edges[end] += known
    return np.sqrt(total / np.maximum(edges, 1.0))


def _second_difference(light: np.ndarray, active: np.ndarray, axis: int) -> np.ndarray:
    """Norm of the second difference along ``axis`` at every node; 0 where a neighbour is missing or not active. At the
    ends of the axis the neighbour's holds."""
    result = np.zeros(active.shape)
    count = active.shape[axis]
    if count < 3:
        return result
    before, middle, after = (_part(axis, slice(i, count - 2 + i)) for i in range(3))
    known = active[before] & active[middle] & active[after]
    norm = np.linalg.norm(light[before] - 2 * light[middle] + light[after], axis=-1)
    result[middle] = np.where(known, norm, 0.0)
    for end, neighbour in ((0, 1), (count - 1, count - 2)):
        result[_part(axis, end)] = result[_part(axis, neighbour)]
    return result


def _cell_means(share: np.ndarray, active: np.ndarray) -> np.ndarray:
    """Mean over the active corners of every cell, at its first corner."""
    total, weight = np.where(active, share, 0.0), active.astype(float)
    for axis in range(3):
        count = share.shape[axis]
        if count > 1:
            low, high = _part(axis, slice(0, count - 1)), _part(axis, slice(1, count))
            for values in (total, weight):
                values[low] = values[low] + values[high]
                values[_part(axis, count - 1)] = values[_part(axis, count - 2)]
    return total / np.maximum(weight, 1.0)


def _part(axis: int, selection) -> tuple:
    return (*[slice(None)] * axis, selection)
