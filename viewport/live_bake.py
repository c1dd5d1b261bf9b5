# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that follows changes, a slice in every frame.

The first change bakes the volumes once more and keeps those bakes on the GPU; from then on only what a change asks for
is computed again (``bake/session.py``). A relight that runs when the next change comes is finished first: while a lamp
moves without pause, views show its light as it was a moment ago, all of one moment, instead of none at all.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..bake.result import Silent
from ..bake.session import BakeSession
from ..core.errors import GridlightError
from ..core.field import Field
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot


@dataclass(frozen=True)
class Target:
    """A volume whose light shall follow. ``edits``: probes that were switched off or moved by hand."""

    grid: Grid
    edits: ProbeEdits | None

    def equals(self, other: Target) -> bool:
        """Whether a bake for ``other`` can be relit for this one."""
        same_grid = self.grid.resolution == other.grid.resolution and np.array_equal(
            self.grid.matrix, other.grid.matrix
        )
        mine, others = (item.edits or ProbeEdits.none(item.grid) for item in (self, other))
        return (
            same_grid and np.array_equal(mine.disabled, others.disabled) and np.array_equal(mine.offset, others.offset)
        )


class LiveBake:
    """``follow`` tells of a new state of the scene, ``step`` works on it. ``message``: what went wrong last."""

    def __init__(self):
        self.message = ""
        self._wanted: tuple[SceneSnapshot, list[Target], BakeSettings] | None = None
        self._steps: Iterator[dict[str, Field]] | None = None
        self._kept: dict[str, tuple[Target, BakeSession]] = {}

    @property
    def is_working(self) -> bool:
        return self._wanted is not None or self._steps is not None

    @property
    def is_waiting(self) -> bool:
        """Whether a scene was given that nothing has begun with."""
        return self._wanted is not None

    def follow(self, snapshot: SceneSnapshot, targets: list[Target], settings: BakeSettings) -> None:
        """The scene is now ``snapshot``; the light of ``targets`` shall follow."""
        self._wanted = (snapshot, targets, settings)

    def step(self, budget_seconds: float) -> dict[str, Field]:
        """Works for about ``budget_seconds``; the volumes' new fields by name, once they are all done."""
        started = time.perf_counter()
        while self.is_working and time.perf_counter() - started < budget_seconds:
            if self._steps is None:
                self._steps, self._wanted = self._relight(*self._wanted), None
            steps, self._steps = self._steps, None  # they are over if they raise
            try:
                fields = next(steps)
            except GridlightError as error:  # nothing to bake, or it does not fit the GPU
                self.message = str(error)
                return {}
            if fields:
                self.message = ""
                return fields
            self._steps = steps
        return {}

    def _relight(
        self, snapshot: SceneSnapshot, targets: list[Target], settings: BakeSettings
    ) -> Iterator[dict[str, Field]]:
        """Yields nothing (an empty dictionary) after each step, and at last the fields by volume."""
        before, self._kept = self._kept, {}  # a bake that is given up half-way is of no more use
        fields = {}
        for target in targets:
            name = target.grid.name
            known, session = before.pop(name, (None, None))
            if session is not None and session.settings == settings and known.equals(target):
                steps = session.relight(snapshot)
            else:
                session = BakeSession(snapshot, target.grid, settings, Silent(), target.edits)
                steps = session.bake()
            for _ in steps:
                yield {}
            self._kept[name] = (target, session)
            fields[name] = session.result.field
        yield fields
