# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as they are shown: Blender's Standard view, and where one sample a pixel shows."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view


def standard_view(radiance: np.ndarray, exposure: float) -> np.ndarray:
    """Display values 0..1 of linear ``radiance``: Blender's Standard view, which is exposure in stops and the sRGB
    curve (IEC 61966-2-1)."""
    linear = np.clip(np.nan_to_num(radiance) * 2.0**exposure, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def uneven(values: np.ndarray, least: float) -> np.ndarray:
    """(H, W) bool: pixels that differ from one above, below or beside them by more than ``least`` in a channel of
    display ``values`` (H, W, C), and those next to such pixels. Edges, patterns and noise do; a smooth wall does
    not."""
    found = np.zeros(values.shape[:2], bool)
    for axis in (0, 1):
        differs = (np.abs(np.diff(values, axis=axis)) > least).any(axis=2)
        none = np.zeros_like(differs.take([0], axis))
        found |= np.concatenate([none, differs], axis) | np.concatenate([differs, none], axis)
    return sliding_window_view(np.pad(found, 1), (3, 3)).any(axis=(2, 3))
