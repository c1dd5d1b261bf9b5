# SPDX-License-Identifier: GPL-3.0-or-later
"""Places on surfaces as patches keep them, (…, 4): position and packed normal."""

from __future__ import annotations

import numpy as np

from .cubemap import octahedral_encode, pack_normal, unpack_normal
from .rays import pull_back


def split(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals (C, 3 each) of places (C, 4), float64."""
    at = at.astype(float)
    return at[:, :3], unpack_normal(np.maximum(at[:, 3], 0.0))


def off_surface(points: np.ndarray, directions: np.ndarray, distances: np.ndarray, sheets: np.ndarray) -> np.ndarray:
    """Hit ``points`` (H, 3) as patches keep them: pulled back along their rays, but on the surface itself where that is
    a sheet (H,), which rays leave on both sides."""
    return np.where((sheets > 0)[:, None], points, pull_back(points, directions, distances))


def pack(normals: np.ndarray, surface: np.ndarray) -> np.ndarray:
    """(C,) packed ``normals`` (C, 3), −1 where there is no ``surface`` (C,)."""
    packed = np.full(len(normals), -1.0)
    packed[surface] = pack_normal(octahedral_encode(normals[surface]))
    return packed
