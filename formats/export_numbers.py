# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers as an export stores them: half or single precision, as bytes or as text."""

from __future__ import annotations

import numpy as np

LARGEST_HALF = 65504.0
DIM = 6e-3  # below it values a hundred times smaller than the peak lose digits as half floats (subnormal from 6.1e-5)
PRECISIONS = ("half", "float")


class Encoder:
    """Rounds to the precision asked for and remembers what that cost.

    ``clipped`` counts values beyond a half float's range, ``peak`` is the largest magnitude seen.
    """

    def __init__(self, precision: str):
        self.precision = precision
        self.clipped = 0
        self.peak = 0.0

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """``values`` as float16 or float32, contiguous."""
        if values.size:
            self.peak = max(self.peak, float(np.abs(values).max()))
        if self.precision == "float":
            return np.ascontiguousarray(values, np.float32)
        self.clipped += int((np.abs(values) > LARGEST_HALF).sum())
        return np.ascontiguousarray(np.clip(values, -LARGEST_HALF, LARGEST_HALF), np.float16)

    def warnings(self) -> list[str]:
        """What the user should know about the rounding; complete when everything has been encoded."""
        found = []
        if self.clipped:
            found.append(
                f"{self.clipped} values are beyond the range of half floats and were cut at {LARGEST_HALF:.0f}; "
                "use a gain below 1 (--gain), or floats (--precision float)"
            )
        if self.precision == "half" and 0 < self.peak < DIM:
            found.append(
                f"the light is dim (at most {self.peak:.2g}), half floats keep few digits of it; use a gain above 1 "
                "(--gain), or floats (--precision float)"
            )
        return found


def listing(values: np.ndarray) -> str:
    """``values``, flattened, as numbers separated by ", " with the digits that restore them exactly."""
    flat = np.ravel(values)
    if np.issubdtype(flat.dtype, np.integer):
        return ", ".join(map(str, flat.tolist()))
    digits = {2: 5, 4: 9, 8: 17}[flat.dtype.itemsize]
    return (f"%.{digits}g, " * len(flat) % tuple(flat.tolist()))[:-2]
