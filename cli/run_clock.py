# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds per phase of one run of the command line, as its summary and report state them."""

from __future__ import annotations

import time

from ..bake.stopwatch import Stopwatch

PHASES = ("setup", "read", "cull", "capture", "light", "write", "total")


class RunClock(Stopwatch):
    """Seconds by phase; the total is the time since the clock was made."""

    def __init__(self):
        super().__init__(dict.fromkeys(PHASES, 0.0))
        self._started = time.perf_counter()

    def add(self, seconds: dict[str, float]) -> None:
        """Adds what a bake or relight took, by phase."""
        for phase, value in seconds.items():
            self.seconds[phase] += value

    def totals(self) -> dict[str, float]:
        """Seconds by phase so far, to the microsecond, and their "total" by the wall."""
        self.seconds["total"] = time.perf_counter() - self._started
        return {phase: round(self.seconds[phase], 6) for phase in PHASES}
