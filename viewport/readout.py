# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast views are drawn, and how well the light keeps up with the scene."""

from __future__ import annotations

import time


class Readout:
    """Numbers for the eye: frames a second, probes a frame, age of the light."""

    def __init__(self):
        self._frames: list[float] = []
        self.probes_per_frame = 0
        self._slices = 0
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

    def worked(self) -> None:
        """A slice of a relight has been done."""
        self._slices += 1

    def relit(self, probes: int, up_to_date: bool) -> None:
        """``probes`` have new light; ``up_to_date`` if nothing has changed since that began."""
        self.probes_per_frame = round(probes / max(self._slices, 1))
        self._slices = 0
        if up_to_date:
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
