# SPDX-License-Identifier: GPL-3.0-or-later
"""What of a closure is mirrored, as one lobe of GGX facets: see core/gloss.py."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..core.conventions import LUMINANCE
from ..core.gloss import Gloss
from .shader_values import Value, add, constant

# Of the light, times (1 − roughness)⁵, times the root of its share of all that is sent back. Below, a lobe is sent in
# all directions and shows lamps (core/highlights.py); what it would show of lit surfaces is not worth a bake of four to
# twelve times the work. Plastic of roughness 0.3, metal of 0.6 and all that is duller come as near to Cycles so
# (docs/measurements.md, Gloss and mirrors).
LEAST_GLOSS = 0.012


@dataclass(frozen=True)
class Mirrored:
    """``color`` is its mean albedo; ``facing`` (3,) what facets reflect that are seen face on."""

    color: Value
    facing: np.ndarray
    roughness: float

    def of(self, color: Value) -> Mirrored:
        """The same facets with another ``color``."""
        return replace(self, color=color)

    def is_faint(self, sent_back: Value) -> bool:
        """Whether of all that is ``sent_back`` it makes too little of a difference to be followed."""
        light, all_ = self.color.number(), max(sent_back.number(), 1e-9)
        return light * (1 - self.roughness) ** 5 * (light / all_) ** 0.5 < LEAST_GLOSS

    def gloss(self, sent_back: Value) -> Gloss | None:
        """It as a part of all that is ``sent_back``; None where nothing is mirrored."""
        if self.color.is_zero():
            return None
        fixed = self.color.is_constant
        share = self.color.rgb() if fixed else self.color.rgb() / np.maximum(sent_back.rgb(), 1e-9)
        return Gloss(_colour(share), _colour(self.facing), float(np.clip(self.roughness, 0.0, 1.0)), fixed)


NOTHING_MIRRORED = Mirrored(constant([0.0, 0.0, 0.0]), np.ones(3), 0.0)


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


def _colour(values: np.ndarray) -> tuple[float, float, float]:
    red, green, blue = np.clip(values, 0.0, 1.0).tolist()
    return red, green, blue
