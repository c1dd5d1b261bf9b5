# SPDX-License-Identifier: GPL-3.0-or-later
"""What nodes of a lamp (IES profiles, textures, falloffs) make of its light, by direction and by distance.

A profile is a factor on the light that the lamp would send without nodes: a map of directions in the lamp's own frame,
in the layout of ``core.panorama``, times a curve over the distance, which is a power law between its points.
Readable twin of direct_light_lib.glsl's ``profile_factor``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .panorama import panorama_coordinates

WIDTH, HEIGHT = 64, 32
DISTANCES_M = 0.25 * 4.0 ** np.arange(5)
ELEMENTS = WIDTH * HEIGHT + len(DISTANCES_M)  # of the GPU's array
_LEAST = 1e-12  # factor: what no power law reaches


@dataclass(frozen=True, eq=False)
class LightProfile:
    """``by_direction`` (HEIGHT, WIDTH, 3) factors; ``by_distance`` (len(DISTANCES_M),) factors."""

    by_direction: np.ndarray
    by_distance: np.ndarray

    def __eq__(self, other: object) -> bool:
        return isinstance(other, LightProfile) and all(
            np.array_equal(getattr(self, name), getattr(other, name)) for name in ("by_direction", "by_distance")
        )

    __hash__ = None  # type: ignore[assignment]

    def rows(self) -> np.ndarray:
        """(ELEMENTS, 4) float32 as the GPU reads it."""
        rows = np.zeros((ELEMENTS, 4), np.float32)
        rows[: WIDTH * HEIGHT, :3] = np.asarray(self.by_direction).reshape(-1, 3)
        rows[WIDTH * HEIGHT :, 0] = np.log2(np.maximum(self.by_distance, _LEAST))
        return rows

    def factor(self, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """(N, 3) factors on light sent along ``directions`` (N, 3) in the lamp's frame over ``distances`` (N,)
        metres."""
        position = panorama_coordinates(directions) * [WIDTH, HEIGHT] - 0.5
        low = np.floor(position).astype(int)
        result = np.zeros((len(directions), 3))
        for step in np.ndindex(2, 2):
            weight = np.where(step, position - low, 1 - (position - low)).prod(axis=1)
            column, row = (low[:, 0] + step[0]) % WIDTH, np.clip(low[:, 1] + step[1], 0, HEIGHT - 1)
            result += weight[:, None] * np.asarray(self.by_direction, float)[row, column]
        curve = np.log2(np.maximum(self.by_distance, _LEAST))
        place = np.log2(np.maximum(distances, 1e-6) / DISTANCES_M[0]) / 2
        first = np.clip(np.floor(place), 0, len(curve) - 2).astype(int)
        along = curve[first] + (place - first) * (curve[first + 1] - curve[first])
        return result * np.exp2(along)[:, None]
