# SPDX-License-Identifier: GPL-3.0-or-later
"""A grid of probe nodes in an oriented box.

Node (i, j, k) sits at min + (i/(nx−1), j/(ny−1), k/(nz−1))·(max−min) in the box's own frame −1..1, which ``matrix``
maps to the world; a count of 1 puts the node in the middle. The flat index of a node is i + nx·(j + ny·k).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .conventions import MOST_REACH_M
from .errors import InputError
from .settings import MAX_RESOLUTION

_LEAST_EDGE_M = 1e-9


@dataclass(frozen=True)
class Grid:
    """The nodes of one volume.

    Raises:
        InputError: a resolution outside 1..256, a transform that is not finite, or a box without volume, or too small,
            large or far for 32 bits.
    """

    matrix: np.ndarray  # (4, 4) float64, box frame −1..1 to world
    resolution: tuple[int, int, int]
    name: str = "volume"

    def __post_init__(self):
        for count in self.resolution:
            if not 1 <= count <= MAX_RESOLUTION:
                shown = ",".join(map(str, self.resolution))
                raise InputError(f"resolution {shown}: every axis needs 1 to {MAX_RESOLUTION} probes")
        if not np.isfinite(self.matrix).all():
            raise InputError(f"{self.name}: its transform holds values that are not finite; reset its scale")
        axes = self.matrix[:3, :3]
        lengths = np.linalg.norm(axes, axis=0)
        if not lengths.all():
            axis = "XYZ"[int(np.argmin(lengths))]
            raise InputError(f"{self.name}: zero size along {axis}; scale it along every axis, also one with one probe")
        most = 2 * float(lengths.max())
        if not _LEAST_EDGE_M <= most <= MOST_REACH_M or abs(self.matrix[:3, 3]).max() > MOST_REACH_M:
            raise InputError(
                f"{self.name}: its box is {most:.3g} m large and up to {abs(self.matrix[:3, 3]).max():.3g} m away; "
                f"scale it to between {_LEAST_EDGE_M:g} and {MOST_REACH_M:g} m, and keep it within {MOST_REACH_M:g} m"
            )
        if abs(np.linalg.det(axes / lengths)) < 1e-9:
            raise InputError(f"{self.name}: its box has no volume; undo its shear")

    @classmethod
    def from_bounds(cls, low, high, resolution, name: str = "volume") -> Grid:
        """Axis-aligned box from world-space corners ``low`` and ``high``, (3,) each, metres."""
        low, high = np.asarray(low, float), np.asarray(high, float)
        if not (np.isfinite(low).all() and np.isfinite(high).all()):
            raise InputError("--min and --max must be finite numbers")
        if (high <= low).any():
            axis = "XYZ"[int(np.argmax(high <= low))]
            raise InputError(f"the volume has no size along {axis}: --max must be greater than --min")
        matrix = np.diag([*(high - low) / 2, 1.0])
        matrix[:3, 3] = (low + high) / 2
        nx, ny, nz = (int(n) for n in resolution)
        return cls(matrix, (nx, ny, nz), name)

    @property
    def count(self) -> int:
        nx, ny, nz = self.resolution
        return nx * ny * nz

    def has_nodes_of(self, other: Grid) -> bool:
        """Whether every node is where that of ``other`` is; names may differ."""
        return tuple(self.resolution) == tuple(other.resolution) and np.array_equal(self.matrix, other.matrix)

    @property
    def center(self) -> np.ndarray:
        """(3,) float64 world position of the box's middle."""
        return self.matrix[:3, 3].copy()

    @property
    def origin(self) -> np.ndarray:
        """(3,) float64 world position that all GPU work is relative to: the box's middle, or that of the whole of which
        this is a part."""
        return self.center

    def coordinates(self, node: int) -> tuple[int, int, int]:
        """(i, j, k) of the node with flat index ``node``."""
        nx, ny, _ = self.resolution
        return int(node % nx), int(node // nx % ny), int(node // (nx * ny))

    def lattice(self) -> np.ndarray:
        """(count, 3) integer node coordinates (i, j, k) in flat order."""
        nx, ny, nz = self.resolution
        k, j, i = np.meshgrid(np.arange(nz), np.arange(ny), np.arange(nx), indexing="ij")
        return np.stack([i.ravel(), j.ravel(), k.ravel()], axis=1)

    def positions(self) -> np.ndarray:
        """(count, 3) float64 world positions of the nodes in flat order."""
        spans = np.maximum(np.array(self.resolution) - 1, 1)
        single = np.array(self.resolution) == 1
        local = np.where(single, 0.0, 2.0 * self.lattice() / spans - 1.0)
        return local @ self.matrix[:3, :3].T + self.matrix[:3, 3]

    def world_to_lattice(self) -> np.ndarray:
        """(3, 4) float64: lattice = M[:, :3] @ world + M[:, 3], with node (i, j, k) at exactly those coordinates.

        Along an axis with one node the coordinate is 0 everywhere.
        """
        inverse = np.linalg.inv(self.matrix)
        half_spans = (np.array(self.resolution) - 1) / 2.0
        lattice = half_spans[:, None] * inverse[:3]
        lattice[:, 3] += half_spans
        return lattice

    def cell_size(self) -> np.ndarray:
        """(3,) float64 world length of one cell along each axis of the box; the box itself where there is one node."""
        spans = np.maximum(np.array(self.resolution) - 1, 1)
        return 2.0 * np.linalg.norm(self.matrix[:3, :3], axis=0) / spans
