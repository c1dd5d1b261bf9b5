# SPDX-License-Identifier: GPL-3.0-or-later
"""The baked field: what a bake produces, a probe file holds and a lookup reads."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .conventions import ACTIVE, CULLED, DEPTH_EDGE, INVALID, bands_of
from .depth_map import DEPTH_VALUES
from .gradients import gradient_bands
from .grid import Grid


def state_counts(state: np.ndarray) -> dict[str, int]:
    """Probes of ``state`` (P,) in all and by state."""
    named = {"active": ACTIVE, "culled": CULLED, "invalid": INVALID}
    return {"total": len(state)} | {name: int((state == value).sum()) for name, value in named.items()}


@dataclass
class Field:
    """Radiance SH of all probes of one grid, with what a lookup needs. P = ``grid.count``, flat node order.

    ``offset`` is the displacement of the capture position from the node in metres. ``depth`` is an octahedral map
    (row-major, DEPTH_EDGE² texels): mean and mean square of the distance to the nearest surface in metres and metres²;
    the normal, on the probe's side, of what is in the texel's middle (``pack_normal``; the background faces the probe,
    as far away as depth is looked for; 0: not known), and its distance. ``gradient`` is the change of the coefficients
    that irradiance needs, K of them, per metre along the world's axes; zero where it is not given, and of probes
    without light of their own (``holds_light``).
    ``metadata`` is the JSON part of the probe file.
    """

    grid: Grid
    coefficients: np.ndarray  # (P, bands², 3) float32 radiance
    state: np.ndarray  # (P,) uint8: CULLED, ACTIVE, INVALID
    validity: np.ndarray  # (P,) float32: share of the sphere that is not back faces, 0..1
    offset: np.ndarray  # (P, 3) float32 metres
    depth: np.ndarray  # (P, DEPTH_EDGE², DEPTH_VALUES) float32
    metadata: dict = field(default_factory=dict)
    # (P, 3, K, 3) float32, K = min(bands, 3)²; __post_init__ fills it in
    gradient: np.ndarray = None  # type: ignore[assignment]

    def __post_init__(self):
        not_known = DEPTH_VALUES - self.depth.shape[-1]  # as they were stored before more than moments was
        if not_known:
            self.depth = np.pad(self.depth, ((0, 0), (0, 0), (0, not_known)))
        if self.gradient is None:
            self.gradient = np.zeros((self.grid.count, 3, gradient_bands(self.bands) ** 2, 3), np.float32)

    @property
    def bands(self) -> int:
        return bands_of(self.coefficients.shape[1])

    @property
    def holds_light(self) -> np.ndarray:
        """(P,) bool: the light was captured there and not filled in from around. Besides active probes that are culled
        ones in the open, which have depth statistics (core/open_air.py)."""
        return (self.state == ACTIVE) | ((self.state == CULLED) & self.depth.any(axis=(1, 2)))

    @classmethod
    def empty(cls, grid: Grid, bands: int) -> Field:
        """A field of zeros, all active, with nothing in sight."""
        count = grid.count
        return cls(
            grid,
            np.zeros((count, bands * bands, 3), np.float32),
            np.full(count, ACTIVE, np.uint8),
            np.ones(count, np.float32),
            np.zeros((count, 3), np.float32),
            np.zeros((count, DEPTH_EDGE * DEPTH_EDGE, DEPTH_VALUES), np.float32),
        )
