# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's background as the texels of a cubemap see it."""

from __future__ import annotations

import numpy as np

from .conventions import FACE_FORWARD, FACE_RIGHT, FACE_UP
from .cubemap import direction_to_texel, texel_solid_angles
from .panorama import panorama_directions, panorama_solid_angles
from .snapshot import World

_PEAK = 10.0  # times the map's mean: what is brighter counts as a sun


def world_texels(world: World, face: int) -> np.ndarray:
    """(6, face, face, 3) mean radiance of the background over each texel.

    A map is averaged into texels by solid angle; pixels larger than a third of a texel are split first. How much of a
    texel the pixels that fall into it cover is off by some percent, which a mean does not mind but a sun of one pixel
    would: what stands out of the map is shared out between the four texels around it and divided by their exact solid
    angles, so it keeps its energy at any face size, and its direction, which a single texel would move by degrees.
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
            texel, share = _four_around(directions[rows].reshape(-1, 3)[above], face)
            peaks[:, channel] += np.bincount(texel.ravel(), (share * energy[:, None]).ravel(), len(weight))
    exact = np.tile(texel_solid_angles(face).ravel(), 6)
    return (mean / weight[:, None] + peaks / exact[:, None]).reshape(6, face, face, 3)


def _four_around(directions: np.ndarray, face: int) -> tuple[np.ndarray, np.ndarray]:
    """Flat indices (N, 4) of the texels around ``directions`` (N, 3) and their shares (N, 4) of a bilinear blend, which
    add up to 1. Past a face's edge the next face's texel there stands in."""
    index, _, _ = direction_to_texel(directions, face)
    depth = np.einsum("ni,ni->n", directions, FACE_FORWARD[index])
    axes = FACE_RIGHT[index], FACE_UP[index]
    place = np.stack([np.einsum("ni,ni->n", directions, axis) / depth for axis in axes], axis=1)
    place = (place * 0.5 + 0.5) * face - 0.5
    first = np.floor(place)
    texels, shares = [], []
    for step in np.ndindex(2, 2):
        centre = (first + step + 0.5) * 2.0 / face - 1.0
        towards = FACE_FORWARD[index] + centre[:, :1] * axes[0] + centre[:, 1:] * axes[1]
        side, row, column = direction_to_texel(towards, face)
        texels.append((side * face + row) * face + column)
        shares.append(np.where(step, place - first, 1 - (place - first)).prod(axis=1))
    return np.stack(texels, axis=1), np.stack(shares, axis=1)
