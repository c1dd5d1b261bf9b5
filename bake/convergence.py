# SPDX-License-Identifier: GPL-3.0-or-later
"""When light iterations may stop, and how much light is still missing.

Iterations are a geometric series: once one mode dominates, each change is r times the one before, and what is still to come is
change · r/(1−r). That sum, not the last change, is held against the tolerance; a furnace with albedo 0.99 shows why: its changes are
1 % of the field when 63 % of the light is still missing. Where the ratio has settled, the sum is added at once (Aitken's delta-squared
process), which saves most iterations of bright rooms.
"""

from __future__ import annotations

import math

AUTO_LIMIT = 512
_SETTLED = 0.02  # relative difference of two ratios that counts as settled
_MOST_RATIO = 0.9985  # above it the tail is too uncertain to add


class Convergence:
    """Watches iterations. ``bounces`` None means as many as needed up to AUTO_LIMIT."""

    def __init__(self, bounces: int | None, tolerance: float):
        self._bounces = bounces
        self._tolerance = tolerance
        self._ratio = math.nan
        self._since_extrapolation = 0
        self.iterations = 0
        self.changes: list[float] = []  # relative change of the field per iteration
        self.missing = math.inf  # estimated share of the energy still to come
        self.done = False
        self.converged = False
        self.reason = ""

    def add(self, energy: float, change: float) -> float:
        """Takes |field|² and |change|² of one iteration. Returns the factor to extrapolate by, 0 for none.

        The first iteration gathers direct light and emission, each further one is a bounce.
        """
        self.iterations += 1
        self._since_extrapolation += 1
        relative = math.sqrt(change / energy) if energy > 0 else 0.0
        previous = self.changes[-1] if self.changes else math.nan
        self.changes.append(relative)
        last_ratio, self._ratio = self._ratio, relative / previous if previous > 0 else math.nan
        ratio = self._ratio
        if relative == 0.0:
            self.missing = 0.0
        elif ratio < 1.0:
            self.missing = relative * ratio / (1.0 - ratio)
        else:
            self.missing = math.inf
        settled = self._since_extrapolation >= 4 and abs(ratio - last_ratio) < _SETTLED * (1.0 - ratio)
        enough = self.missing < self._tolerance and self._since_extrapolation >= 2
        bounces = self.iterations - 1
        if self._bounces is not None:
            self.done = bounces >= self._bounces
            self.converged = True
            self.reason = f"stopped after the {self._bounces} bounces asked for, {self.missing:.2g} of the light estimated missing"
            return 0.0
        if enough:
            self.done = self.converged = True
            self.reason = (f"converged after {self.iterations} iterations: an estimated {self.missing:.2g} of the light is missing, "
                           f"tolerance {self._tolerance:g}")
            return 0.0
        if bounces >= AUTO_LIMIT:
            self.done = True
            self.reason = (f"not converged after {AUTO_LIMIT} bounces: each still adds {ratio:.4f} of the one before; "
                           "surfaces that reflect all light never settle, lower their base colour")
            return 0.0
        if settled and 0.0 < ratio < _MOST_RATIO:
            self._since_extrapolation = 0
            self._ratio = math.nan
            return ratio / (1.0 - ratio)
        return 0.0
