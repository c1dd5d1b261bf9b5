# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probes of a grid light some surface.

A probe is needed when one of the (up to 8) cells that it is a corner of contains surface: an exact triangle–box overlap
test (Akenine-Möller, "Fast 3D Triangle-Box Overlap Testing", JGT 2001) in lattice coordinates, where cells are unit
cubes. Lookups outside the box are clamped to its boundary, so surface outside counts too:

* boundary cells reach half a cell beyond the box;
* farther out, a boundary cell that some surface clamps to and that has no needed corner yet gets all its corners.
  One lit corner is enough to serve distant surface, none would leave it black.
"""

from __future__ import annotations

import numpy as np

from .cell_ranges import cells_of_boxes
from .grid import Grid
from .triangles import bounds

REACH = 0.5  # how far boundary cells reach beyond the box, in cells
_PAIRS_AT_ONCE = 1 << 18  # bounds the memory of one overlap test to about 150 MB


def needed_nodes(grid: Grid, triangles: np.ndarray) -> np.ndarray:
    """(P,) bool: the nodes of ``grid`` that light some of ``triangles`` (T, 3, 3), world metres."""
    local = _to_cell_space(grid, triangles)
    low, high = bounds(local)
    near = occupied_cells(grid, local, REACH)
    needed = _corners_of(near)
    outside = local[(low < -REACH).any(axis=1) | (high > _cells(grid) + REACH).any(axis=1)]
    if len(outside):
        unserved = occupied_cells(grid, outside, np.inf) & ~near & ~_any_corner(needed)
        needed |= _corners_of(unserved)
    nx, ny, nz = grid.resolution
    return needed[:nx, :ny, :nz].transpose(2, 1, 0).ravel()


def occupied_cells(grid: Grid, local: np.ndarray, reach: float) -> np.ndarray:
    """(cx, cy, cz) bool: cells that overlap ``local`` (T, 3, 3), triangles in cell space.

    Boundary cells are ``reach`` cells longer towards the outside.
    """
    cells = _cells(grid)
    occupied = np.zeros(cells, bool)
    low, high = bounds(local)
    inside = ((high >= -reach) & (low <= cells + reach)).all(axis=1)
    local, low, high = local[inside], low[inside], high[inside]
    # A triangle that touches a cell's face belongs to the cells of both sides.
    first = np.clip(np.ceil(low) - 1, 0, cells - 1).astype(np.int64)
    last = np.clip(np.floor(high), 0, cells - 1).astype(np.int64)
    single = (first == last).all(axis=1)
    occupied[tuple(first[single].T)] = True

    many = np.flatnonzero(~single)
    for which, cell in cells_of_boxes(first[many], last[many], _PAIRS_AT_ONCE):
        triangle = many[which]
        open_ = ~occupied[tuple(cell.T)]  # a cell found once needs no second test
        triangle, cell = triangle[open_], cell[open_]
        cell_low = np.where(cell == 0, -reach, cell)
        cell_high = np.where(cell == np.array(cells) - 1, cells + reach, cell + 1)
        if not np.isfinite(reach):  # a box as large as what it is tested against is as good as an endless one
            cell_low = np.maximum(cell_low, low[triangle] - 1)
            cell_high = np.minimum(cell_high, high[triangle] + 1)
        hit = triangles_overlap_boxes(local[triangle], (cell_low + cell_high) / 2, (cell_high - cell_low) / 2)
        occupied[tuple(cell[hit].T)] = True
    return occupied


def triangles_overlap_boxes(triangles: np.ndarray, centres: np.ndarray, half_sizes: np.ndarray) -> np.ndarray:
    """(N,) bool: does each of ``triangles`` (N, 3, 3) touch its box, (N, 3) centre and (N, 3) half size?

    Separating axes: 3 box normals, the triangle's normal, 9 cross products of edges. Touching counts as overlap.
    """
    v = triangles - centres[:, None, :]
    low, high = bounds(v)
    overlap = ((low <= half_sizes) & (high >= -half_sizes)).all(axis=1)
    edges = np.roll(v, -1, axis=1) - v
    normal = np.cross(edges[:, 0], edges[:, 1])
    distance = np.abs(np.einsum("ni,ni->n", normal, v[:, 0]))
    overlap &= distance <= np.einsum("ni,ni->n", np.abs(normal), half_sizes)
    for edge in range(3):
        for axis in range(3):
            a, b = (axis + 1) % 3, (axis + 2) % 3
            # cross(unit axis, edge) has only the components a and b
            ea, eb = -edges[:, edge, b], edges[:, edge, a]
            projected = v[:, :, a] * ea[:, None] + v[:, :, b] * eb[:, None]
            radius = half_sizes[:, a] * np.abs(ea) + half_sizes[:, b] * np.abs(eb)
            overlap &= (projected.min(axis=1) <= radius) & (projected.max(axis=1) >= -radius)
    return overlap


def _cells(grid: Grid) -> np.ndarray:
    """(3,) cells along each axis; an axis with one node has one cell, the box's whole extent."""
    return np.maximum(np.array(grid.resolution) - 1, 1)


def _to_cell_space(grid: Grid, triangles: np.ndarray) -> np.ndarray:
    """``triangles`` (T, 3, 3) in coordinates where cell (i, j, k) is the unit cube at (i, j, k)."""
    inverse = np.linalg.inv(grid.matrix)
    scale = _cells(grid) / 2.0
    matrix = inverse[:3, :3] * scale[:, None]
    shift = scale * (inverse[:3, 3] + 1.0)
    return triangles @ matrix.T + shift


def _corners_of(cells: np.ndarray) -> np.ndarray:
    """Node array, one longer per axis than ``cells``, true at the corners of true cells.

    Axes with one node have two corner planes that mean the same node; both carry the mark.
    """
    nodes = np.zeros(np.array(cells.shape) + 1, bool)
    for corner in np.ndindex(2, 2, 2):
        nodes[tuple(slice(c, c + n) for c, n in zip(corner, cells.shape))] |= cells
    return nodes


def _any_corner(nodes: np.ndarray) -> np.ndarray:
    """Cell array: has the cell a corner that is true in ``nodes``?"""
    cells = np.zeros(np.array(nodes.shape) - 1, bool)
    for corner in np.ndindex(2, 2, 2):
        cells |= nodes[tuple(slice(c, c + n) for c, n in zip(corner, cells.shape))]
    return cells
