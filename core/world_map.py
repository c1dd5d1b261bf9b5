# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's background as the texels of a cubemap see it."""

from __future__ import annotations

import numpy as np

from .cubemap import direction_to_texel
from .panorama import panorama_directions, panorama_solid_angles
from .snapshot import World


def world_texels(world: World, face: int) -> np.ndarray:
    """(6, face, face, 3) mean radiance of the background over each texel.

    A map is summed into texels by solid angle, so that even a sun of one pixel keeps its energy at any face size; pixels larger
    than a third of a texel are split first.
    """
    if world.map is None:
        return np.broadcast_to(np.asarray(world.color, float), (6, face, face, 3)).copy()
    height, width = world.map.shape[:2]
    split = max(1, int(np.ceil(12.0 * face / height)))
    texels = np.zeros((6 * face * face, 3))
    weight = np.zeros(6 * face * face)
    rows_at_once = max(1, (1 << 20) // (width * split))
    directions = panorama_directions(width * split, height * split)
    solid_angles = panorama_solid_angles(width * split, height * split)
    for start in range(0, height * split, rows_at_once):
        rows = slice(start, start + rows_at_once)
        index, row, column = direction_to_texel(directions[rows].reshape(-1, 3), face)
        flat = (index * face + row) * face + column
        omega = solid_angles[rows].ravel()
        source = np.repeat(world.map[np.arange(height * split)[rows] // split], split, axis=1).reshape(-1, 3)
        weight += np.bincount(flat, omega, len(weight))
        for channel in range(3):
            texels[:, channel] += np.bincount(flat, omega * source[:, channel], len(weight))
    return (texels / weight[:, None]).reshape(6, face, face, 3)
