# SPDX-License-Identifier: GPL-3.0-or-later
"""All the surface of one material as an atlas: every triangle gets a square of texels of its own.

Corner 0 lies on the centre of the square's first texel, corner 1 at the end of its first row, corner 2 at the end of
its first column, so bilinear lookups within the triangle never leave the square and two texels an edge hold what is
given at corners exactly::

    2 .                 texels beyond the diagonal's neighbours are never
    o . .               looked up; they repeat the triangle from the other
    o o . .             side, so that the square's mean is the triangle's
    0 o o 1

numpy only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_MOST_WIDTH = 1024
MOST_TEXELS = 1 << 16  # unless two texels an edge, or one a triangle, take more
_MOST_AT_CORNERS, _MOST_TRIANGLES = 1 << 18, 1 << 20
_EDGES = np.array([2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128])


@dataclass(frozen=True)
class Atlas:
    """Which place of which triangle each texel shows; T triangles, P texels."""

    shape: tuple[int, int]  # rows, columns
    corner_uvs: np.ndarray  # (T, 3, 2) float32
    triangle: np.ndarray  # (P,) int32; texels without one repeat the first triangle's
    barycentric: np.ndarray  # (P, 2) float32, weights of corners 1 and 2; outside 0..1 past the diagonal

    def interpolate(self, corners: np.ndarray) -> np.ndarray:
        """(P, C) values at the texels of ``corners`` (T, 3, C)."""
        u, v = self.barycentric[:, :1], self.barycentric[:, 1:]
        a, b, c = (corners[self.triangle, corner] for corner in range(3))
        return a * (1 - u - v) + b * u + c * v


def fits(count: int) -> bool:
    """Whether ``count`` triangles fit an atlas at all."""
    return 0 < count <= _MOST_TRIANGLES


def lay_out(longest_edge: np.ndarray) -> Atlas:
    """Squares for triangles whose longest edges are ``longest_edge`` (T,) metres, as fine as the budget allows."""
    edges = _texels_per_edge(longest_edge)
    widest = int(edges.max())
    width = min(-(-int(np.ceil(np.sqrt((edges * edges).sum()))) // widest) * widest, _MOST_WIDTH // widest * widest)
    x, y = np.zeros((2, len(edges)), np.int64)
    row = 0
    for edge in np.unique(edges)[::-1]:
        mine = np.flatnonzero(edges == edge)
        per_shelf = width // edge
        x[mine] = np.arange(len(mine)) % per_shelf * edge
        y[mine] = row + np.arange(len(mine)) // per_shelf * edge
        row += -(-len(mine) // per_shelf) * int(edge)
    triangle = np.zeros(row * width, np.int32)
    barycentric = np.zeros((row * width, 2), np.float32)
    for edge in np.unique(edges):
        mine = np.flatnonzero(edges == edge)
        j, i = np.divmod(np.arange(edge * edge), edge)
        texel = (y[mine][:, None] + j) * width + x[mine][:, None] + i
        triangle[texel] = mine[:, None]
        steps = max(int(edge) - 1, 1)
        place = np.stack([i, j], 1) / steps if edge > 1 else np.full((1, 2), 1 / 3)
        past = place.sum(axis=1) > 1 + 1.001 / steps
        barycentric[texel] = np.where(past[:, None], 1 - place, place)
    size = np.array([width, row], float)
    reach = (edges - 1)[:, None]
    first = np.stack([x, y], 1) + 0.5
    uvs = np.stack([first, first + reach * [1, 0], first + reach * [0, 1]], axis=1) / size
    return Atlas((row, width), uvs.astype(np.float32), triangle, barycentric)


def _texels_per_edge(longest_edge: np.ndarray) -> np.ndarray:
    """(T,) of ``_EDGES``, or 1 everywhere: the finest spacing that the budget allows."""
    count = len(longest_edge)
    if count > _MOST_AT_CORNERS:
        return np.ones(count, np.int64)
    low, high = np.log(max(longest_edge.max(), 1e-30) / 127), np.log(max(longest_edge.max(), 1e-30) * 2)
    best = np.full(count, 2, np.int64)
    for _ in range(24):
        middle = (low + high) / 2
        wanted = longest_edge / np.exp(middle) + 1
        edges = _EDGES[np.clip(np.searchsorted(_EDGES, wanted), 0, len(_EDGES) - 1)]
        if (edges * edges).sum() <= MOST_TEXELS:
            best, high = edges, middle
        else:
            low = middle
    return best
