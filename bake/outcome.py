# SPDX-License-Identifier: GPL-3.0-or-later
"""What baking one block leaves behind: plain arrays, from which the field of the whole grid is finished."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass
class BlockOutcome:
    """S probes of one block that were captured, in the order of its slots."""

    nodes: np.ndarray  # (S,) int64 indices in the whole grid
    offset: np.ndarray  # (S, 3) float32 metres from the node to where the probe captures
    shares: np.ndarray  # (S, 4) float32 of the sphere, see GpuBackend.read_shares
    coefficients: np.ndarray  # (S, bands², 3) float32 radiance
    depth: np.ndarray  # (S, DEPTH_EDGE², DEPTH_VALUES) float32
    gradient: np.ndarray  # (S, 3, K, 3) float32, not limited
    hollow: np.ndarray  # (H,) int64 of nodes: probes in hollows that were still filling with light
    moved: int = 0  # probes that were moved out of walls
    patches: int = 0
    iterations: int = 0
    converged: bool = True
    missing: float = 0.0  # estimated share of the light still to come
    reason: str = ""  # why the bounces ended
    energy: tuple[float, ...] = ()  # per iteration, as in BakeResult
    change: tuple[float, ...] = ()


ARRAYS = ("nodes", "offset", "shares", "coefficients", "depth", "gradient", "hollow")
