# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's background as the texels of a cubemap see it."""

from __future__ import annotations

import numpy as np

from .cubemap import direction_to_texel, texel_solid_angles
from .panorama import panorama_directions, panorama_solid_angles
from .snapshot import World

_PEAK = 10.0  # times the map's mean: what is brighter counts as a sun


def world_texels(world: World, face: int) -> np.ndarray:
    """(6, face, face, 3) mean radiance of the background over each texel.

    A map is averaged into texels by solid angle; pixels larger than a third of a texel are split first. How much of a
    texel the pixels that fall into it cover is off by some percent, which a mean does not mind but a sun of one pixel
    would: what stands out of the map is summed and divided by the texel's exact solid angle, so it keeps its energy at
    any face size.
    """
    if world.map is None:
        return np.broadcast_to(np.asarray(world.color, float), (6, face, face, 3)).copy()
    height, width = world.map.shape[:2]
    split = max(1, int(np.ceil(12.0 * face / min(height, width / 2))))
    mean, peaks = np.zeros((2, 6 * face * face, 3))
    weight = np.zeros(6 * face * face)
    rows_at_once = max(1, (1 << 20) // (width * split))
    directions = panorama_directions(width * split, height * split)
    solid_angles = panorama_solid_angles(width * split, height * split)
    pixel_share = panorama_solid_angles(width, height) / (4 * np.pi)
    limit = _PEAK * np.einsum("hw,hwc->c", pixel_share, world.map)
    for start in range(0, height * split, rows_at_once):
        rows = slice(start, start + rows_at_once)
        index, row, column = direction_to_texel(directions[rows].reshape(-1, 3), face)
        flat = (index * face + row) * face + column
        omega = solid_angles[rows].ravel()
        source = np.repeat(world.map[np.arange(height * split)[rows] // split], split, axis=1).reshape(-1, 3)
        weight += np.bincount(flat, omega, len(weight))
        for channel in range(3):
            level = np.minimum(source[:, channel], limit[channel])
            mean[:, channel] += np.bincount(flat, omega * level, len(weight))
            above = np.flatnonzero(source[:, channel] > limit[channel])
            energy = omega[above] * (source[above, channel] - limit[channel])
            peaks[:, channel] += np.bincount(flat[above], energy, len(weight))
    exact = np.tile(texel_solid_angles(face).ravel(), 6)
    return (mean / weight[:, None] + peaks / exact[:, None]).reshape(6, face, face, 3)
