# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a closure is mirrored, as one lobe of GGX facets: see core/gloss.py."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.conventions import LUMINANCE
from ..core.gloss import Gloss
from .shader_values import Value, add, constant

# Of the light, times 1 − roughness: lobes with less stay diffuse, as mirrored or not makes no difference to probes that
# would be worth rays (docs/measurements.md, Gloss).
LEAST_GLOSS = 0.05


@dataclass(frozen=True)
class Mirrored:
    """``color`` is its mean albedo; ``facing`` (3,) what facets reflect that are seen face on."""

    color: Value
    facing: np.ndarray
    roughness: float

    @property
    def matters(self) -> bool:
        return self.color.number() * (1 - self.roughness) >= LEAST_GLOSS

    def of(self, color: Value) -> Mirrored:
        """The same facets with another ``color``."""
        return replace(self, color=color)

    def gloss(self, sent_back: Value) -> Gloss | None:
        """It as a part of all that is ``sent_back``; None where it does not matter."""
        if not self.matters:
            return None
        fixed = self.color.is_constant
        share = self.color.rgb() if fixed else self.color.rgb() / np.maximum(sent_back.rgb(), 1e-9)
        red, green, blue = np.clip(share, 0.0, 1.0).tolist()
        first, second, third = np.clip(self.facing, 0.0, 1.0).tolist()
        return Gloss((red, green, blue), (first, second, third), float(np.clip(self.roughness, 0.0, 1.0)), fixed)


NOTHING_MIRRORED = Mirrored(constant([0.0, 0.0, 0.0]), np.ones(3), 0.0)


def mirrored_by(color: Value, facing: np.ndarray, roughness: float) -> Mirrored:
    """A lobe of mean albedo ``color``; nothing where it does not matter."""
    lobe = Mirrored(color, np.asarray(facing, float), roughness)
    return lobe if lobe.matters else NOTHING_MIRRORED


def joined(first: Mirrored, second: Mirrored) -> Mirrored:
    """Two lobes as one between them."""
    one, other = first.color.rgb() @ LUMINANCE, second.color.rgb() @ LUMINANCE
    if one <= 0 or other <= 0:
        return second if one <= 0 else first
    share = other / (one + other)
    return Mirrored(
        add(first.color, second.color),
        first.facing + share * (second.facing - first.facing),
        first.roughness + share * (second.roughness - first.roughness),
    )
