# SPDX-License-Identifier: GPL-3.0-or-later
"""How a bake shares the time with the window that it runs in: work and what Blender does itself, such as drawing."""

from __future__ import annotations

import time

from ..core.steps import STEP_SECONDS

MOST_SECONDS = 0.25  # of work in a turn
_SHOW_SECONDS, _MOST_SHOW_SECONDS = 0.1, 1.0  # between two pictures of the progress
_SHOW_SHARE = 0.2  # of the time that drawing them may take


class Turns:
    """A turn of work is as long as Blender has just taken for itself, a step at least.

    Without a GPU a window takes many times as long to be drawn as a step of the bake. The bake still gets half of the
    time, and nothing that is pressed comes more than twice as late.
    """

    def __init__(self):
        self._ended = time.perf_counter()  # the last turn
        self._shown = self._ended - _SHOW_SECONDS
        self._pause_seconds = _SHOW_SECONDS  # between two pictures of the progress

    def begin(self) -> float:
        """Begins a turn; returns when no other step shall begin in it, in seconds of time.perf_counter."""
        began = time.perf_counter()
        away = began - self._ended
        if self._shown == self._ended:  # it has drawn the progress meanwhile
            self._pause_seconds = min(max(away / _SHOW_SHARE, _SHOW_SECONDS), _MOST_SHOW_SECONDS)
        return began + min(max(away, STEP_SECONDS), MOST_SECONDS)

    def end(self) -> bool:
        """Ends the turn; returns whether the progress shall be shown now."""
        self._ended = time.perf_counter()
        is_due = self._ended - self._shown >= self._pause_seconds
        if is_due:
            self._shown = self._ended
        return is_due
