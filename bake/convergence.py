# SPDX-License-Identifier: GPL-3.0-or-later
"""When light iterations may stop, and how much light is still missing.

Iterations are a geometric series: once one mode dominates, each change is r times the one before, and what is still to
come is change · r/(1−r). That sum, not the last change, is held against the tolerance; a furnace with albedo 0.99
shows why: its changes are 1 % of the field when 63 % of the light is still missing. Where the changes have become
parallel, the sum is added at once (Aitken's delta-squared process for vectors), which saves most iterations of bright
rooms. Parallel matters: a mode that alternates in sign shrinks just as steadily and would be blown up. Two estimates
in a row must be below the tolerance: bright lamps in view and a dim room around them are two modes, and the first
changes tell only of the fast one.

A closed cupboard of white walls fills with light for thousands of bounces. After PATIENCE of them nobody waits for such
hollows if they are a minor part that holds little light, and everything else has settled; that they are there is told.
Before that they are not extrapolated to their limit, which nobody could check: path tracers give up as early.
"""

from __future__ import annotations

import math

from ..core.extrapolation import STATES, Sums
from ..core.patches import PATIENCE

AUTO_LIMIT = 512
MANY_MODES = math.inf  # in place of a factor: the last states tell the limit, see core/extrapolation.py
_PARALLEL = 0.5  # most sine of the angle between two changes for the tail to be added, per (1 − ratio)
_SINE_ROUNDING = 1e-6  # squared sine below what float32 sums can tell from zero
_LEAST = 3  # changes of a series that tell of its limit
_LEAST_WARM = 4  # the first tells of lamps, not of bounces, so that three are seldom enough
_MOST_AHEAD = 3  # iterations that go on unwatched: each that was not needed costs about what looking costs a GPU
_MOST_RATIO = 0.9985  # above it the tail is too uncertain to add
_MINOR, _LITTLE = 0.25, 0.25  # share of the patches and of |light| that hollows may have where nobody waits for them
_ANY = 1e-3  # share of the patches: less is no hollow
_ROUNDING = 5e-7  # relative change that is nothing but float32 rounding


class Convergence:
    """Watches iterations. ``bounces`` None means as many as needed up to AUTO_LIMIT. ``warm``: from light that was
    settled before something changed."""

    def __init__(self, bounces: int | None, tolerance: float, warm: bool = False):
        self._bounces = bounces
        self._tolerance = tolerance
        self._lengths: list[float] = []  # |change| of the iterations since the last extrapolation
        self._least_first = _LEAST_WARM if warm else _LEAST
        self._slowest = 0.0  # ratio of the slowest mode that was extrapolated: changes may still hold some of it
        self._last_ratio = math.inf
        self.iterations = 0
        self.changes: list[float] = []  # relative change of the field per iteration
        self.missing = math.inf  # estimated share of the light still to come
        self.done = False
        self.converged = False
        self.has_hollows = False  # that are still filling with light
        self.reason = ""

    @property
    def until_decision(self) -> int:
        """How many more iterations it takes at least until something follows from them: nobody has to wait for the sums
        of the ones before. From fewer than _LEAST changes of one series nothing does, and where light is likely to need
        more anyway the next of them can tell."""
        least = _LEAST if self.iterations else self._least_first
        ahead = max(least - len(self._lengths), self._likely_ahead())
        return ahead if self._bounces is None else min(ahead, self._bounces + 1 - self.iterations)

    def _likely_ahead(self) -> int:
        """Iterations until light has settled, at most _MOST_AHEAD, if changes go on as they did; at least one."""
        if not 0.0 < self._last_ratio < 1.0 or not self._tolerance < self.missing < math.inf:
            return 1
        steps = math.log(self._tolerance / self.missing) / math.log(self._last_ratio)
        return min(math.ceil(steps) + 1, _MOST_AHEAD)  # two estimates in a row have to be small

    def add(self, sums: Sums, is_newest: bool = True) -> float:
        """Takes the sums of one iteration, the ``is_newest`` or one that others have followed already. Returns the
        factor to extrapolate by, 0 for none, MANY_MODES where the last STATES states are to tell; where others have
        followed always 0, as only the newest state can be extrapolated.

        The first iteration is direct light and may be dark: what glows and the world arrive with the first bounce.
        Each further one is a bounce.
        """
        energy, change, overlap = sums[:3]
        self.iterations += 1
        self._lengths.append(math.sqrt(change))
        if not (math.isfinite(energy) and math.isfinite(change)):
            self.done, self.changes = True, [*self.changes, math.inf]
            self.reason = (
                f"not converged after {self.iterations} iterations: light grows without end; "
                "surfaces send out more than they get, lower their base colour"
            )
            return 0.0
        relative = math.sqrt(change / energy) if energy > 0 else 0.0
        self.changes.append(relative)
        ratio = max(_ratio(self._lengths), self._slowest)
        last_missing, self.missing = self.missing, _still_missing(relative, ratio)
        self._last_ratio = ratio
        if self._bounces is not None:
            self._count(self._bounces)
            return 0.0
        self._judge(sums, relative, ratio, last_missing)
        return self._leap(sums, overlap) if is_newest and not self.done else 0.0

    def _count(self, bounces: int) -> None:
        """Ends after ``bounces``, settled or not."""
        self.done = self.iterations - 1 >= bounces
        self.converged = self.missing < self._tolerance
        self.reason = (
            f"stopped after the {bounces} bounces asked for, an estimated {self.missing:.2g} of the light is missing"
        )

    def _judge(self, sums: Sums, relative: float, ratio: float, last_missing: float) -> None:
        """Is the light settled, or beyond hope? After a ``relative`` change that was ``ratio`` of the one before."""
        bounces = self.iterations - 1
        if bounces and self.missing < self._tolerance and (last_missing < self._tolerance or relative < _ROUNDING):
            self.done = self.converged = True
            self.reason = (
                f"converged after {self.iterations} iterations: an estimated {self.missing:.2g} "
                f"of the light is missing, tolerance {self._tolerance:g}"
            )
        elif bounces >= PATIENCE and _has_hollows(sums) and sums.open_tail < self._tolerance**2 * sums.open_energy:
            self.done = self.converged = self.has_hollows = True
            self.missing = math.sqrt(sums.open_tail / sums.open_energy)
            self.reason = (
                f"converged after {self.iterations} iterations: an estimated {self.missing:.2g} of the light is "
                f"missing, tolerance {self._tolerance:g}, but for hollows that are still filling with light"
            )
        elif bounces >= AUTO_LIMIT:
            self.done = True
            self.reason = (
                f"not converged after {AUTO_LIMIT} bounces: each still adds {ratio:.4f} of the one before; "
                "surfaces that reflect all light never settle, lower their base colour"
            )

    def _leap(self, sums: Sums, overlap: float) -> float:
        """What ``add`` returns for light that goes on: the factor to extrapolate by. Begins a new series where it does
        not stay."""
        if len(self._lengths) >= _LEAST and self._is_parallel(overlap):
            step = self._lengths[-1] / self._lengths[-2]
            self._slowest = max(self._slowest, step)
            self._lengths.clear()
            return step / (1.0 - step)
        bounces = self.iterations - 1
        if (
            len(self._lengths) >= STATES
            and self._lengths[-1] < _MOST_RATIO * self._lengths[-2]
            and (bounces >= 2 * PATIENCE or not _has_hollows(sums))  # what is no hollow settles by itself
        ):
            # the first change after an extrapolation is not of its series
            self._slowest = max(self._slowest, min(self._lengths[-1] / self._lengths[-2], _MOST_RATIO))
            self._lengths.clear()
            return MANY_MODES
        return 0.0

    def _is_parallel(self, overlap: float) -> bool:
        """Do the last two changes belong to one mode? The slower it is, the more it is multiplied and the less else
        may be in it."""
        last, before = self._lengths[-1], self._lengths[-2]
        if overlap <= 0 or last >= _MOST_RATIO * before:
            return False
        sine_squared = max(1.0 - (overlap / (last * before)) ** 2, 0.0)
        least = max((_PARALLEL * (1.0 - last / before)) ** 2, _SINE_ROUNDING)
        return sine_squared < least


def _has_hollows(sums: Sums) -> bool:
    """Are there slow patches that are a minor part and hold little light?"""
    return _ANY < sums.slow < _MINOR and sums.energy - sums.open_energy < _LITTLE**2 * sums.energy


def _still_missing(relative: float, ratio: float) -> float:
    """Share of the light that is still to come after a ``relative`` change that was ``ratio`` of the one before."""
    if relative < _ROUNDING:
        return relative
    return relative * ratio / (1.0 - ratio) if ratio < 1.0 else math.inf


def _ratio(lengths: list[float]) -> float:
    """By how much a change is smaller than the one before, the larger of the last step and the mean of the last two:
    where a fast mode hides a slow one the last step is first to show it, where changes alternate the mean is
    steadier."""
    if len(lengths) < 2 or lengths[-2] == 0:
        return math.inf
    step = lengths[-1] / lengths[-2]
    return max(step, math.sqrt(lengths[-1] / lengths[-3])) if len(lengths) >= 3 and lengths[-3] > 0 else step
