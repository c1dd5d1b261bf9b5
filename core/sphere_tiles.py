# SPDX-License-Identifier: GPL-3.0-or-later
"""Which spheres each tile of a picture can show, so that a pixel asks few of them.

A sphere's image reaches, along one axis of the picture, from plane to plane: planes through the eye and the other axis
that touch the sphere. With the ray through place x being forward + x·right + y·up, their normals are
n(x) = (forward + x·right) × up, and the sphere at q from the eye with radius R touches where (q·n)² = R²·n², a
quadratic in x. That holds for shifted lenses as well.
"""

from __future__ import annotations

import numpy as np

from .camera import Camera

TILE = 16  # pixels along an edge


def tiled_spheres(spheres: np.ndarray, radii: np.ndarray, camera: Camera, width: int, height: int) -> np.ndarray:
    """(tiles + E, 4) float32: for each tile, row by row from the bottom, (first row, number, 0, 0) of its spheres; then
    these rows of ``spheres`` (S, 4), whose centres stand first, with ``radii`` (S,), in their order within a tile."""
    columns, rows = -(-width // TILE), -(-height // TILE)
    offset = spheres[:, :3] - camera.position
    left, right = _bounds(offset, radii, camera, camera.right, camera.up)
    bottom, top = _bounds(offset, radii, camera, camera.up, camera.right)
    low_x, high_x = _tiles(left, right, width, columns)
    low_y, high_y = _tiles(bottom, top, height, rows)
    spans = np.maximum(high_x - low_x, 0), np.maximum(high_y - low_y, 0)
    count = spans[0] * spans[1]
    sphere = np.repeat(np.arange(len(spheres)), count)
    nth = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    across = spans[0][sphere]
    tile = (low_y[sphere] + nth // np.maximum(across, 1)) * columns + low_x[sphere] + nth % np.maximum(across, 1)
    order = np.lexsort((sphere, tile))
    table = np.zeros((columns * rows, 4), np.float32)
    table[:, 1] = np.bincount(tile, minlength=len(table))
    table[:, 0] = len(table) + np.cumsum(table[:, 1]) - table[:, 1]
    return np.concatenate([table, spheres[sphere[order]].astype(np.float32)])


def _bounds(
    offset: np.ndarray, radii: np.ndarray, camera: Camera, axis: np.ndarray, other: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(S,) each: from where to where spheres at ``offset`` (S, 3) from the eye may reach along ``axis`` of the picture,
    which is 2 wide; turned around for those behind the eye."""
    if camera.orthographic:
        normal = np.cross(other, camera.forward)
        reach = radii * np.linalg.norm(normal)
        ends = np.stack([offset @ normal - reach, offset @ normal + reach]) / (axis @ normal)
        return ends.min(axis=0), ends.max(axis=0)
    at_zero, slope = np.cross(camera.forward, other), np.cross(axis, other)
    depth = offset @ slope * np.sign(camera.forward @ slope) / np.linalg.norm(slope)
    before = depth > radii
    squared = radii**2
    a = (offset @ slope) ** 2 - squared * (slope @ slope)
    b = (offset @ at_zero) * (offset @ slope) - squared * (at_zero @ slope)
    c = (offset @ at_zero) ** 2 - squared * (at_zero @ at_zero)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    a = np.where(before, a, 1.0)
    behind = depth < -radii
    low = np.where(before, (-b - root) / a, np.where(behind, np.inf, -np.inf))
    return low, np.where(before, (-b + root) / a, -low)


def _tiles(low: np.ndarray, high: np.ndarray, pixels: int, tiles: int) -> tuple[np.ndarray, np.ndarray]:
    """(S,) int64 each: the first of ``tiles`` and the one after the last that the range of places touches, with a pixel
    to spare."""
    first, last = ((np.clip(ends, -2.0, 2.0) + 1.0) * (pixels / 2) for ends in (low, high))
    first, last = np.floor((first - 1) / TILE), np.floor((last + 1) / TILE) + 1
    return np.clip(first, 0, tiles).astype(np.int64), np.clip(last, 0, tiles).astype(np.int64)
