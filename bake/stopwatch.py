# SPDX-License-Identifier: GPL-3.0-or-later
"""Seconds per phase of a bake."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from ..core.steps import Result, Steps


class Stopwatch:
    """Adds the time of steps to their phase. GPU work is counted where the program waits for it."""

    def __init__(self, seconds: dict[str, float]):
        """``seconds`` is what it adds to."""
        self.seconds = seconds

    @contextmanager
    def __call__(self, phase: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[phase] = self.seconds.get(phase, 0.0) + time.perf_counter() - start

    def steps(self, phase: str, steps: Steps[Result]) -> Steps[Result]:
        """Follows ``steps`` and adds their time, but not what passes between them."""
        while True:
            with self(phase):
                try:
                    next(steps)
                except StopIteration as end:
                    return end.value
            yield
