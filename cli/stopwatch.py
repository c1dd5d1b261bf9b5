# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds per phase of one run of the command line, as its summary and report state them."""

from __future__ import annotations

import time
from contextlib import contextmanager

PHASES = ("setup", "read", "cull", "capture", "light", "write", "total")


class Stopwatch:
    """``seconds`` by phase. The total is the time since it was made."""

    def __init__(self):
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._started = time.perf_counter()

    @contextmanager
    def measure(self, phase: str):
        started = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[phase] += time.perf_counter() - started

    def add(self, seconds: dict) -> None:
        for phase, value in seconds.items():
            self.seconds[phase] += value

    def totals(self) -> dict:
        self.seconds["total"] = time.perf_counter() - self._started
        return {phase: round(self.seconds[phase], 6) for phase in PHASES}
