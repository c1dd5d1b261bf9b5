# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake is cut into blocks: boxes of nodes that are captured, lit and projected one by one.

Each block has patches, bounces and random numbers of its own, so its cost depends on what is near it and not on how
large the world is: cells of patches grow with the distance from the block's box, like the rings of a clipmap. Blocks
are cut by this rule alone, never by memory, workers or shards, so that all of them give the same bytes::

    7 × 4 nodes, at most 8 a block          the longest side is halved, in metres, until the nodes are few enough;
    · · · ·│· · ·                           blocks are numbered along the cuts, lower halves first
    · · · ·│· · ·
    ───────┼──────
    · · · ·│· · ·
    · · · ·│· · ·
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .grid import Grid

_ALIKE = 1e-6  # relative difference of two sides that rounding may make: then the first axis is cut
_SEED_STEP = 0x9E3779B1  # odd, far from all simple ratios: seeds of neighbours have nothing in common
_SEED_BITS = 31


@dataclass(frozen=True)
class BlockGrid(Grid):
    """The nodes of a block as a grid of their own, in the frame of the whole. ``whole_center`` (3,) world metres."""

    whole_center: np.ndarray | None = None

    @property
    def origin(self) -> np.ndarray:
        return np.array(self.whole_center, float)


@dataclass(frozen=True)
class Block:
    """Block ``index`` of ``count``: nodes ``low`` .. ``high`` (excluded) along each axis of ``resolution`` nodes."""

    index: int
    count: int
    low: tuple[int, int, int]
    high: tuple[int, int, int]
    resolution: tuple[int, int, int]

    @property
    def is_whole(self) -> bool:
        """Is it the only one?"""
        return self.count == 1

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along each axis."""
        x, y, z = (high - low for low, high in zip(self.low, self.high))
        return x, y, z

    @property
    def size(self) -> int:
        """Nodes."""
        return int(np.prod(self.shape))

    def nodes(self) -> np.ndarray:
        """(size,) flat indices of its nodes in the whole grid, ascending."""
        i, j, k = (np.arange(low, high) for low, high in zip(self.low, self.high))
        nx, ny, _ = self.resolution
        return (i + nx * (j[:, None] + ny * k[:, None, None])).ravel()

    def grid(self, whole: Grid) -> Grid:
        """The block's own box, which ends at its outer nodes; the whole itself where there is but one block.

        Where it has one node along an axis it reaches half a cell to both sides, so that cells keep their size.
        """
        if self.is_whole:
            return whole
        spans = np.maximum(np.array(self.resolution) - 1, 1)
        low, last = np.array(self.low, float), np.array(self.high, float) - 1
        single = (np.array(self.shape) == 1) & (np.array(self.resolution) > 1)
        low, last = np.where(single, low - 0.5, low), np.where(single, last + 0.5, last)
        alone = np.array(self.resolution) == 1
        middle = np.where(alone, 0.0, (low + last) / spans - 1.0)  # in the frame −1..1 of the whole
        half = np.where(alone, 1.0, (last - low) / spans)
        matrix = np.array(whole.matrix, float)
        matrix[:3, 3] = whole.matrix[:3, :3] @ middle + whole.matrix[:3, 3]
        matrix[:3, :3] = whole.matrix[:3, :3] * half
        return BlockGrid(matrix, self.shape, whole.name, whole.center)

    def seed(self, seed: int) -> int:
        """The seed of this block's random numbers, from that of the bake; 0 .. 2³¹ − 1."""
        return (seed + self.index * _SEED_STEP) % (1 << _SEED_BITS)


def cut(grid: Grid, most: int) -> list[Block]:
    """``grid`` in blocks of at most ``most`` nodes, in their order."""
    nx, ny, nz = (int(count) for count in grid.resolution)
    resolution = nx, ny, nz
    boxes = _halved((0, 0, 0), resolution, grid.cell_size(), most)
    return [Block(index, len(boxes), low, high, resolution) for index, (low, high) in enumerate(boxes)]


def _halved(low: tuple, high: tuple, cell: np.ndarray, most: int) -> list[tuple[tuple, tuple]]:
    shape = np.subtract(high, low)
    if shape.prod() <= most:
        return [(low, high)]
    length = np.where(shape > 1, shape * cell, 0.0)
    axis = int(np.argmax(length >= (1.0 - _ALIKE) * length.max()))
    middle = low[axis] + int(shape[axis] + 1) // 2
    first_high = tuple(middle if i == axis else value for i, value in enumerate(high))
    second_low = tuple(middle if i == axis else value for i, value in enumerate(low))
    return _halved(low, first_high, cell, most) + _halved(second_low, high, cell, most)
