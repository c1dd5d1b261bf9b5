# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes that stand in a wall or behind it are moved out to where the light is (the field's ``offset``).

A volume that reaches into its walls has a layer of nodes that see nothing, while the wall's surface then reads only
the next layer inside. A probe without light whose nearest surface is close is captured from the other side of that
surface, never farther than half a cell from its node, so that it stays the nearest probe of its part of the room. In an
edge or a corner of a room there is another wall behind the first: ways out may follow one another. Where walls overlap
all of them may lead outside or to the next wall; the last way is a share of a cell into the volume.
"""

from __future__ import annotations

import numpy as np

from .grid import Grid
from .orientation import inside_solid

_LEAST_BEHIND = 0.25  # share of back faces, or of background, in sight of a probe that stands in or behind a wall
_REACH = 0.5  # cells
_MARGIN = 0.05  # cells between a moved probe and the surface it came through
_OPPOSITE = 0.5  # cosine beyond which a way leads to the other side of a wall
_ALIKE = 1e-3  # relative difference of costs that tells nothing
_BACK = 0.15  # cosine beyond which a way leads back to where a probe came from
INWARD_CELLS = (0.25, 0.5)  # of the last way, one after the other
_OUTWARD_PENALTY = 0.5  # how much farther than inwards the way out of the volume counts


def misplaced(shares: np.ndarray, light_elsewhere: bool = False) -> np.ndarray:
    """(S,) bool of probes worth moving, from shares (S, 4) of back faces of solids, background, lit and all back
    faces. ``light_elsewhere``: probes that are not among these see light."""
    dark = shares[:, 2] == 0
    return inside_solid(shares, light_elsewhere) | (dark & (np.maximum(shares[:, 1], shares[:, 3]) > _LEAST_BEHIND))


def moves(grid: Grid, home: np.ndarray, exits: np.ndarray, moved: np.ndarray, failed: np.ndarray) -> np.ndarray:
    """(L, 3) displacement in metres of probes that came from world ``home`` (L, 3) and ``moved`` (L, 3) so far, 0 where
    no exit is near enough.

    ``exits`` (L, 6, 4) holds offset and distance of the nearest surface in each cube face. Ways towards the volume's
    centre are preferred: what lies outside is rarely meant. None leads back. Where a way ``failed`` (L, 3) before, to
    the void or to the inside of another solid, the other side of the wall is left.
    """
    offset, distance = exits[..., :3].astype(float), exits[..., 3].astype(float)
    margin = _MARGIN * float(grid.cell_size().min())
    length = distance + margin
    direction = offset / np.maximum(distance, 1e-20)[..., None]
    step = direction * np.minimum(length, 1e12)[..., None]
    inverse = np.linalg.inv(grid.matrix)[:3, :3]
    spans = np.maximum(np.array(grid.resolution) - 1, 1) / 2.0
    in_cells = np.abs((moved[:, None] + step) @ inverse.T) * spans
    near = (in_cells <= _REACH).all(axis=-1)
    back = np.einsum("lfi,li->lf", direction, moved) < -_BACK * np.linalg.norm(moved, axis=1)[:, None]
    other_side = np.einsum("lfi,li->lf", direction, failed) <= -_OPPOSITE * np.linalg.norm(failed, axis=1)[:, None]
    inward = grid.center - home - moved
    inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-20)
    cost = length * (1.0 + _OUTWARD_PENALTY * (1.0 - np.einsum("lfi,li->lf", direction, inward)))
    cost = np.where(near & ~back & other_side, cost, np.inf)
    # Of ways that are alike the first one: rounding must not decide where a probe stands.
    best = (cost <= (1.0 + _ALIKE) * cost.min(axis=1, keepdims=True)).argmax(axis=1)
    row = np.arange(len(home))
    return np.where(np.isfinite(cost[row, best])[:, None], step[row, best], 0.0)


def inward(grid: Grid, nodes: np.ndarray, cells: float) -> np.ndarray:
    """(L, 3) displacement in metres by which ``nodes`` (L,) on faces of the box move ``cells`` away from each of them;
    0 for others, and along axes with one node."""
    lattice = grid.lattice()[nodes]
    last = np.array(grid.resolution) - 1
    towards = np.where(last > 0, (lattice == 0).astype(float) - (lattice == last), 0.0)
    return cells * towards @ (2.0 * grid.matrix[:3, :3] / np.maximum(last, 1)).T
