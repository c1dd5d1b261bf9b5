# SPDX-License-Identifier: GPL-3.0-or-later
"""How fast shown light goes over to new light: fast enough to follow a lamp, slow enough for no probe to be seen
jumping."""

from __future__ import annotations

import math
import time

_SECONDS = 0.1  # after which a third is left of a difference
_MOST_SHARE = 0.5  # of what is left that one frame may go: where frames are rare, too, light takes a few of them
_NOTHING = 0.01  # of a difference that nobody sees


class Fade:
    """``restart`` when there is new light; ``share`` then says frame by frame how much of the way to go."""

    def __init__(self):
        self._left = 0.0
        self._moment = 0.0

    @property
    def is_on(self) -> bool:
        return self._left > 0.0

    def restart(self) -> None:
        if not self.is_on:
            self._moment = time.perf_counter()
        self._left = 1.0

    def share(self) -> float:
        """Of the way that is left, for this frame; 1 in the last."""
        now = time.perf_counter()
        share = min(1.0 - math.exp(-(now - self._moment) / _SECONDS), _MOST_SHARE)
        self._moment = now
        self._left *= 1.0 - share
        if self._left < _NOTHING:
            self._left, share = 0.0, 1.0
        return share
