# SPDX-License-Identifier: GPL-3.0-or-later
"""Which culled nodes are captured all the same: those in the open light no surface, but what moves there.

Light changes over about the distance to the nearest surface. So the nodes next to active ones are all worth a capture,
farther ones every second along each axis, then every fourth; what lies between them is filled (``core.dilation``).
Filled from active nodes alone, the middle of a corridor of 2 m under luminous panels was 19 % off, 5 % with these.
"""

from __future__ import annotations

import numpy as np

from .conventions import ACTIVE, CULLED
from .grid import Grid

OPEN = 3  # a state before capture: culled, but captured
_MOST_SHARE = 1.0  # of the active nodes: where there are more in the open, they stand farther apart
_LAYERS = 8  # around active nodes that are told apart


def open_nodes(grid: Grid, state: np.ndarray, excluded: np.ndarray) -> np.ndarray:
    """(N,) culled nodes to capture, ascending; ``state`` (P,) is ACTIVE or CULLED, ``excluded`` (P,) bool are nodes
    that nobody wants captured."""
    active = state == ACTIVE
    layer = _layers(active.reshape(grid.resolution[::-1]))
    free = (layer > 0) & ~excluded & (state == CULLED)
    stride = 1 << np.maximum(np.log2(np.maximum(layer, 1)).astype(int), 0)
    lattice = np.stack(np.unravel_index(np.arange(grid.count), grid.resolution[::-1]), axis=1)
    coarser = 1
    while True:
        chosen = np.flatnonzero(free & (lattice % (stride * coarser)[:, None] == 0).all(axis=1))
        if len(chosen) <= _MOST_SHARE * active.sum() or coarser >= max(grid.resolution):
            return chosen
        coarser *= 2


def _layers(active: np.ndarray) -> np.ndarray:
    """(P,) steps along axes from the nearest node of ``active`` (nz, ny, nx), at most ``_LAYERS``; 0 for these and
    where there is none."""
    layer = np.zeros(active.shape, np.int64)
    reached = active.copy()
    for number in range(1, _LAYERS + 1):
        grown = reached.copy()
        for axis in range(3):
            ahead, behind = [slice(None)] * 3, [slice(None)] * 3
            ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
            grown[tuple(ahead)] |= reached[tuple(behind)]
            grown[tuple(behind)] |= reached[tuple(ahead)]
        layer[grown & ~reached] = number
        reached = grown
    if active.any():
        layer[~reached] = _LAYERS
    return layer.ravel()
