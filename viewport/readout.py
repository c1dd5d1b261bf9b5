# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast views are drawn, and how well the light keeps up with the scene."""

from __future__ import annotations

import time
from collections import deque

_MOST_CHANGES = 4096  # remembered; older ones count as the oldest of these
_WINDOW_SECONDS = 1.0  # over which frames are counted
_WORKED_FRAMES = 60  # over which probes are


class Readout:
    """Numbers for the eye: frames a second, probes a frame, age of the light."""

    def __init__(self):
        self._frames: list[float] = []
        self._probes: deque[int] = deque(maxlen=_WORKED_FRAMES)
        self._changes: deque[float] = deque(maxlen=_MOST_CHANGES)
        self.draw_seconds = 0.0  # that the last frame took

    def frame(self, seconds: float = 0.0) -> None:
        """A frame has been drawn in ``seconds``."""
        now = time.perf_counter()
        self._frames = [moment for moment in self._frames if now - moment < _WINDOW_SECONDS]
        self._frames.append(now)
        self.draw_seconds = seconds

    def changed(self, moment: float) -> None:
        """The scene changed; the light is as old as the first change that it does not show."""
        self._changes.append(moment)

    def worked(self, probes: int) -> None:
        """A frame worked on light, and ``probes`` have got theirs; none while patches are lit."""
        self._probes.append(probes)

    def shows(self, moment: float) -> None:
        """All light is at least of the state that the scene had at ``moment``."""
        while self._changes and self._changes[0] <= moment:
            self._changes.popleft()

    def forget_changes(self) -> None:
        """Light has come that belongs to the scene as it is."""
        self._changes.clear()

    @property
    def probes_per_frame(self) -> int:
        """Mean over the last frames that worked on light, rounded up."""
        return -(-sum(self._probes) // len(self._probes)) if self._probes else 0

    @property
    def frames_per_second(self) -> float:
        """Over the last second; 0 while nothing moves."""
        now = time.perf_counter()
        recent = [moment for moment in self._frames if now - moment < _WINDOW_SECONDS]
        return (len(recent) - 1) / max(recent[-1] - recent[0], 1e-6) if len(recent) > 1 else 0.0

    @property
    def age_seconds(self) -> float:
        """How long ago the first change happened that the light does not show yet; 0 where it shows all."""
        return time.perf_counter() - self._changes[0] if self._changes else 0.0
