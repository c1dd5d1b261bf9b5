# SPDX-License-Identifier: GPL-3.0-or-later
"""Places on surfaces as patches keep them, (…, 4): position and packed normal."""

from __future__ import annotations

import numpy as np

from .cubemap import octahedral_encode, pack_normal, unpack_normal


def split(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and normals (C, 3 each) of places (C, 4), float64."""
    at = at.astype(float)
    return at[:, :3], unpack_normal(np.maximum(at[:, 3], 0.0))


def pack(normals: np.ndarray, surface: np.ndarray) -> np.ndarray:
    """(C,) packed ``normals`` (C, 3), −1 where there is no ``surface`` (C,)."""
    packed = np.full(len(normals), -1.0)
    packed[surface] = pack_normal(octahedral_encode(normals[surface]))
    return packed
