# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that follows changes by baking again, a slice in every frame.

A bake that runs when the next change comes is finished first: while a lamp moves without pause, views show its light as
it was a moment ago, all of one moment, instead of none at all.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from ..bake.job import BakeResult, bake_steps
from ..core.errors import GridlightError
from ..core.field import Field
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot


class LiveBake:
    """An ``Updater`` of some volumes. ``message`` says what went wrong with the last bake."""

    def __init__(self):
        self.message = ""
        self._wanted: tuple[SceneSnapshot, list[Grid], BakeSettings] | None = None
        self._steps: Iterator[dict[str, Field]] | None = None

    @property
    def is_working(self) -> bool:
        return self._wanted is not None or self._steps is not None

    @property
    def is_waiting(self) -> bool:
        """Whether a scene was given that no bake has begun with."""
        return self._wanted is not None

    def follow(self, snapshot: SceneSnapshot, grids: list[Grid], settings: BakeSettings) -> None:
        """The scene is now ``snapshot``; the light of ``grids`` shall follow."""
        self._wanted = (snapshot, grids, settings)

    def step(self, budget_seconds: float) -> dict[str, Field]:
        """Works for about ``budget_seconds``; the volumes' new fields by name, once they are all done."""
        started = time.perf_counter()
        while self.is_working and time.perf_counter() - started < budget_seconds:
            if self._steps is None:
                self._steps, self._wanted = _bake(*self._wanted), None
            try:
                fields = next(self._steps)
            except GridlightError as error:  # nothing to bake, or it does not fit the GPU
                self.message, self._steps = str(error), None
                return {}
            if fields:
                self.message, self._steps = "", None
                return fields
        return {}


class _Silent:
    """A reporter for bakes that nobody asked for by name."""

    def phase(self, name: str, total: int | None = None) -> None:
        pass

    def advance(self, amount: int = 1) -> None:
        pass

    def note(self, text: str) -> None:
        pass

    def warn(self, text: str) -> None:
        pass


def _bake(snapshot: SceneSnapshot, grids: list[Grid], settings: BakeSettings) -> Iterator[dict[str, Field]]:
    """Yields nothing (an empty dictionary) after each step, and at last the fields by volume."""
    fields = {}
    for grid in grids:
        result = BakeResult()
        for _ in bake_steps(snapshot, grid, settings, _Silent(), result):
            yield {}
        fields[grid.name] = result.field
    yield fields
