# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that follows changes, a slice in every frame.

The first change bakes the volumes once more and keeps those bakes on the GPU; from then on only what a change asks for
is computed again (``bake/session.py``). Where probes stay in their places, that is a round: the light of patches first,
then probe by probe, shuffled (``core/update_order.py``), as many as fit the frame. A change that comes meanwhile begins
the next round as soon as probes had as much time as patches; probes that were left out come first in it.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ..bake.bake_job import BakeJob
from ..bake.block_session import AnySession, open_session
from ..bake.result import Silent
from ..core.errors import GridlightError
from ..core.field import Field
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..core.steps import Pace
from ..core.update_order import change_weights, update_order
from ..gpu_shaders.textures import GpuWait

_STEP_SECONDS = 0.004  # a quarter of a frame


@dataclass(frozen=True)
class Target:
    """A volume whose light shall follow. ``edits``: probes that were switched off or moved by hand."""

    grid: Grid
    edits: ProbeEdits | None

    def equals(self, other: Target) -> bool:
        """Whether a bake for ``other`` can be relit for this one."""
        mine, others = (item.edits or ProbeEdits.none(item.grid) for item in (self, other))
        return self.grid.has_nodes_of(other.grid) and mine.equals(others)


@dataclass
class Progress:
    """What a slice of work brought. ``fields``: of volumes whose probes may stand elsewhere, or, when ``is_settled``,
    that have come to rest; ``probes``: how many have new light on the GPU."""

    fields: dict[str, Field] = field(default_factory=dict)
    probes: int = 0
    is_settled: bool = False


@dataclass
class _Wanted:
    """A state of the scene and when it was seen, seconds of time.perf_counter."""

    snapshot: SceneSnapshot
    targets: list[Target]
    settings: BakeSettings
    moment: float


@dataclass
class _Kept:
    """A bake that lives on the GPU, for ``target``."""

    target: Target
    session: AnySession
    moments: np.ndarray  # (S,) when the state of the scene was seen that each probe shows
    rounds: int = 0
    is_unseen: bool = False  # what is shown is not of this bake


class LiveBake:
    """``follow`` tells of a new state of the scene, ``step`` works on it. ``message``: what went wrong last."""

    def __init__(self, pace: Pace | None = None):
        """``pace``: how much is done in a step; by default a quarter of a frame's work."""
        self.message = ""
        self.shown_moment = 0.0  # all probes show the scene as it was then, or later
        self._wanted: _Wanted | None = None
        self._steps: Iterator[Progress] | None = None
        self._kept: dict[str, _Kept] = {}
        self._is_rough = False  # probes have light that no field tells of yet
        self._is_settling = False
        self._pace = pace or Pace(_STEP_SECONDS, GpuWait())

    @property
    def is_working(self) -> bool:
        return self._wanted is not None or self._steps is not None

    @property
    def is_settling(self) -> bool:
        """Whether nothing but exact fields is being worked on."""
        return self._is_settling and self._steps is not None

    @property
    def is_rough(self) -> bool:
        """Whether ``settle`` has something to do."""
        return self._is_rough

    def backend_of(self, name: str):
        """The GPU's side of a volume's bake; None where there is none, or one for each of several blocks."""
        return self._kept[name].session.backend if name in self._kept else None

    def show_whole(self) -> None:
        """Other light was put in place of what was shown: the next round brings whole fields."""
        for kept in self._kept.values():
            kept.is_unseen = True

    def follow(self, snapshot: SceneSnapshot, targets: list[Target], settings: BakeSettings, moment: float) -> None:
        """The scene was ``snapshot`` at ``moment``; the light of ``targets`` shall follow."""
        self._wanted = _Wanted(snapshot, targets, settings, moment)

    def settle(self) -> None:
        """Has exact fields read back, when nothing changes any more."""
        if self._is_rough and not self.is_working:
            self._is_rough, self._is_settling = False, True
            self._steps = self._finish()

    def step(self, budget_seconds: float) -> Progress:
        """Works for about ``budget_seconds``, and stops early when there are new fields to be shown."""
        started = time.perf_counter()
        progress = Progress()
        while self.is_working:
            if self._steps is None:
                self._steps, self._wanted, self._is_settling = self._round(self._wanted), None, False
            steps, self._steps = self._steps, None  # they are over if they raise
            try:
                made = next(steps)
            except StopIteration:
                continue
            except GridlightError as error:  # nothing to bake, or it does not fit the GPU
                self.message = str(error)
                self._kept.clear()
                self._is_rough = False
                return progress
            self._steps = steps
            progress.probes += made.probes
            if made.fields:
                self.message = ""
                progress.fields, progress.is_settled = made.fields, made.is_settled
                break
            if time.perf_counter() - started > budget_seconds - _STEP_SECONDS:
                break
        return progress

    def _round(self, wanted: _Wanted) -> Iterator[Progress]:
        """Brings all targets to what is wanted; yields after each step."""
        before, self._kept = self._kept, {}  # a bake that is given up half-way is of no more use
        for target in wanted.targets:
            kept = before.pop(target.grid.name, None)
            if kept is None or kept.session.settings != wanted.settings or not kept.target.equals(target):
                del kept
                job = BakeJob(wanted.snapshot, target.grid, wanted.settings, target.edits)
                session = open_session(job, Silent(), pace=self._pace)
                for _ in session.bake():
                    yield Progress()
                moments = np.full(len(session.unshown), wanted.moment)
                self._kept[target.grid.name] = _Kept(target, session, moments)
                yield Progress({target.grid.name: session.result.field}, len(moments))
            else:
                yield from self._relight(wanted, kept)
        moments = [kept.moments.min(initial=wanted.moment) for kept in self._kept.values()]
        self.shown_moment = float(min(moments, default=wanted.moment))

    def _relight(self, wanted: _Wanted, kept: _Kept) -> Iterator[Progress]:
        session = kept.session
        waiting, lights = session.unshown.copy(), session.snapshot.lights
        began = time.perf_counter()
        for _ in session.relight(wanted.snapshot, live=True):
            yield Progress()
        patch_seconds = time.perf_counter() - began
        self._kept[kept.target.grid.name] = kept
        if kept.is_unseen or not session.result.relit.kept_places:
            yield from self._whole(wanted, kept)
            return
        self._is_rough |= bool(session.unshown.any())
        nearest = float(kept.target.grid.cell_size().min())
        weights = change_weights(session.positions, lights, wanted.snapshot.lights, nearest)
        kept.rounds += 1
        order = update_order(weights, waiting, kept.rounds)
        began = time.perf_counter()
        left = int(session.unshown.sum())
        for _ in session.show(order[session.unshown[order]]):
            kept.moments[~session.unshown] = wanted.moment
            now_left = int(session.unshown.sum())
            yield Progress(probes=left - now_left)
            left = now_left
            if self._wanted is not None and time.perf_counter() - began > patch_seconds:
                return  # the others come first in the next round
        kept.moments[:] = wanted.moment

    def _whole(self, wanted: _Wanted, kept: _Kept) -> Iterator[Progress]:
        """All of a bake at once: its probes may stand elsewhere, so nothing of it goes with what is shown."""
        session = kept.session
        for steps in (session.show(), session.finish()):
            for _ in steps:
                yield Progress()
        kept.moments, kept.is_unseen = np.full(len(session.unshown), wanted.moment), False
        yield Progress({kept.target.grid.name: session.result.field}, len(kept.moments))

    def _finish(self) -> Iterator[Progress]:
        fields = {}
        for name, kept in self._kept.items():
            for _ in kept.session.finish():
                yield Progress()
            fields[name] = kept.session.result.field
        yield Progress(fields, is_settled=True)
