# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user decided about single probes of a grid: which are switched off, and which capture from another place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .grid import Grid

CELL_REACH = 0.5  # of a cell along each axis of the box: so far a probe may be moved, then its neighbour is nearer


@dataclass(frozen=True)
class ProbeEdits:
    """P = ``grid.count``, flat node order."""

    disabled: np.ndarray  # (P,) bool: treated as culled
    offset: np.ndarray  # (P, 3) float64 metres, world axes, from the node to where the probe captures

    @classmethod
    def none(cls, grid: Grid) -> ProbeEdits:
        """Every probe as the grid has it."""
        return cls(np.zeros(grid.count, bool), np.zeros((grid.count, 3)))

    @property
    def any(self) -> bool:
        return bool(self.disabled.any() or self.offset.any())

    def equals(self, other: ProbeEdits) -> bool:
        """Whether both decide the same about every probe; for grids with the same number of probes."""
        return np.array_equal(self.disabled, other.disabled) and np.array_equal(self.offset, other.offset)


def bounded(grid: Grid, offset: np.ndarray) -> np.ndarray:
    """``offset`` (P, 3) world metres, held within ``CELL_REACH`` of a cell along each axis of the grid's box."""
    spans = np.maximum(np.array(grid.resolution) - 1, 1)
    cell = 2.0 * grid.matrix[:3, :3] / spans  # columns: one cell along each axis of the box, world metres
    in_cells = offset @ np.linalg.inv(cell).T
    return np.clip(in_cells, -CELL_REACH, CELL_REACH) @ cell.T
