# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in steps: generators that yield between pieces of work, so that a window lives on in between.

What comes out never depends on where the pieces are cut.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator
from typing import Any, TypeVar

Result = TypeVar("Result")
Steps = Generator[None, None, Result]

STEP_SECONDS = 0.02  # that a step shall take: two of them and a redraw fit into what a person takes for immediate
_LOOK_SECONDS = 0.004  # that a step waits for work in the background
_MOST_GROWTH = 4.0  # of a portion from one to the next: the first ones also compile shaders


def run(steps: Steps[Result]) -> Result:
    """Follows ``steps`` to their end."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return end.value


def together(*several: Steps[Any]) -> Steps[list[Any]]:
    """Follows ``several`` in lockstep, so that in each step all of them see the world in one state; their results."""
    results: list[Any] = [None] * len(several)
    running = dict(enumerate(several))
    while running:
        for index, steps in list(running.items()):
            try:
                next(steps)
            except StopIteration as end:
                results[index] = end.value
                del running[index]
        if running:
            yield
    return results


class Pace:
    """How much work goes into a step. ``Pace(None)`` does everything at once: for runs that nobody watches."""

    def __init__(self, step_seconds: float | None, wait: Callable[[], None] = lambda: None):
        """``wait`` returns when the GPU has done what it was told; a step ends there, else it could not be timed."""
        self._seconds = step_seconds
        self._wait = wait
        self._portion: dict[str, int] = {}  # items of a kind that take about a step

    def portions(
        self, kind: str, count: int, work: Callable[[int, int], None], first: int = 16, at_once: int | None = None
    ) -> Steps[None]:
        """Calls ``work(start, number)`` until ``count`` items are done, so many a step as its time allows.

        Args:
            kind: of work; portions of one kind learn from each other.
            first: number in the first portion of a kind.
            at_once: most that one call may be given.
        """
        start = 0
        while start < count:
            number = count - start
            if self._seconds is not None:
                number = min(number, self._portion.get(kind, first))
            number = min(number, at_once or number)
            began = time.perf_counter()
            work(start, number)
            if self._seconds is not None:
                self._wait()
                self._learn(kind, number, self._seconds / max(time.perf_counter() - began, 1e-9))
            start += number
            yield

    def _learn(self, kind: str, number: int, growth: float) -> None:
        """``growth``: how many times ``number`` would have filled the step."""
        self._portion[kind] = max(1, int(number * min(growth, _MOST_GROWTH)))

    def in_background(self, work: Callable[..., Result], *arguments: Any) -> Steps[Result]:
        """Returns ``work(*arguments)``, computed in a thread of its own while steps go by. It must touch neither
        Blender's data nor the GPU. Where steps are not followed to their end, it ends by itself."""
        if self._seconds is None:
            return work(*arguments)
        return (yield from self.meanwhile(work, *arguments))

    def meanwhile(self, work: Callable[..., Result], *arguments: Any) -> Steps[Result]:
        """Begins ``work(*arguments)`` in a thread of its own at once, at any pace, under the terms of
        ``in_background``; the steps wait for what it returns."""
        box: dict[str, Any] = {}

        def compute() -> None:
            try:
                box["result"] = work(*arguments)
            except BaseException as error:  # handed on to whoever follows the steps
                box["error"] = error

        thread = threading.Thread(target=compute, daemon=True, name=f"gridlight {work.__name__}")
        thread.start()
        return self._wait_for(thread, box)

    def _wait_for(self, thread: threading.Thread, box: dict[str, Any]) -> Steps[Any]:
        while True:
            thread.join(None if self._seconds is None else _LOOK_SECONDS)
            if not thread.is_alive():
                break
            yield
        if "error" in box:
            raise box["error"]
        return box["result"]
