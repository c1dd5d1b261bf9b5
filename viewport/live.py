# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that follows changes while one looks: what a view asks of whatever computes it, and the pace."""

from __future__ import annotations

import time
from typing import Protocol


class Updater(Protocol):
    """Keeps the light of one scene up to date in slices."""

    def mark_changed(self, kind: str) -> None:
        """Something of this kind (see ``changes``) is new in the scene that the updater was given."""

    def step(self, budget_seconds: float) -> int:
        """Works for about ``budget_seconds`` and returns how many probes have new light; 0 when all is done."""


class Readout:
    """Numbers for the eye: frames a second, probes a frame, age of the light."""

    def __init__(self):
        self._frames: list[float] = []
        self.probes_per_frame = 0
        self._oldest_change: float | None = None

    def frame(self) -> None:
        """A frame has been drawn."""
        now = time.perf_counter()
        self._frames = [moment for moment in self._frames if now - moment < 1.0]
        self._frames.append(now)

    def changed(self) -> None:
        """The scene changed; the light is as old as the first change that it does not show."""
        if self._oldest_change is None:
            self._oldest_change = time.perf_counter()

    def stepped(self, probes: int, finished: bool) -> None:
        self.probes_per_frame = probes
        if finished:
            self._oldest_change = None

    @property
    def frames_per_second(self) -> float:
        """Over the last second; 0 while nothing moves."""
        if len(self._frames) < 2:
            return 0.0
        return (len(self._frames) - 1) / max(self._frames[-1] - self._frames[0], 1e-6)

    @property
    def age_seconds(self) -> float:
        """How long ago the first change happened that the light does not show yet; 0 where it shows all."""
        return 0.0 if self._oldest_change is None else time.perf_counter() - self._oldest_change
