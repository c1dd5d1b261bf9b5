# SPDX-License-Identifier: GPL-3.0-or-later
"""The last bake's sessions, which stay on the GPU so that a relight need not begin anew.

They go with the next bake, with the file, and with the extension.
"""

from __future__ import annotations

import bpy
from bpy.app.handlers import persistent

from ..bake.bake_job import BakeJob
from ..bake.block_session import open_session
from ..bake.error_driven import ErrorDrivenBake
from ..bake.result import Reporter
from ..core.error_budget import ErrorGoal
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.steps import STEP_SECONDS, Pace, Steps
from ..gpu_shaders.textures import GpuWait
from ..scene.probe_objects import read_edits
from .volume_choice import grid_of


class Relay:
    """A ``bake.result.Reporter`` that passes on to another, which may be replaced: sessions outlive progress bars."""

    def __init__(self, target: Reporter):
        self.target = target

    def phase(self, name: str, total: int | None = None) -> None:
        self.target.phase(name, total)

    def advance(self, amount: int = 1) -> None:
        self.target.advance(amount)

    def note(self, text: str) -> None:
        self.target.note(text)

    def warn(self, text: str) -> None:
        self.target.warn(text)


class KeptBake:
    """A session with what must still hold for it to be relit."""

    def __init__(self, job: BakeJob, reporter: Reporter, goal: ErrorGoal | None = None):
        self.relay = Relay(reporter)
        pace = Pace(STEP_SECONDS, GpuWait())
        self.session = open_session(job, self.relay, pace=pace)
        self._driven = ErrorDrivenBake(job, goal, self.relay, pace=pace) if goal else None
        self._grid, self._settings, self._edits = job.grid, job.settings, job.probe_edits  # not the whole old scene

    def bake(self) -> Steps[None]:
        """The bake in steps; ``session`` has it afterwards."""
        if self._driven is None:
            yield from self.session.bake()
        else:
            yield from self._driven.bake()
            self.session = self._driven.session

    def fits(self, grid: Grid, settings: BakeSettings, edits: ProbeEdits | None) -> bool:
        """Whether a relight gives what a bake of ``grid`` with these settings and edits would. Never where an error was
        asked for: a relight does not look after it."""
        return (
            self._driven is None
            and settings == self._settings
            and grid.has_nodes_of(self._grid)
            and (edits or ProbeEdits.none(grid)).equals(self._edits)
        )


_kept: dict[int, KeptBake] = {}  # by session_uid of the volume's object


def keep(bakes: dict[int, KeptBake]) -> None:
    """Keeps these instead of all others."""
    _kept.clear()
    _kept.update(bakes)


def take(uid: int) -> KeptBake | None:
    """Hands the volume's bake out for good: one that is not followed to its end must not be used again."""
    return _kept.pop(uid, None)


def is_kept(uid: int) -> bool:
    return uid in _kept


def goes_on(scene: bpy.types.Scene, volume: bpy.types.Object) -> bool:
    """Whether a relight of ``volume`` would go on from its last bake; otherwise it bakes anew."""
    kept = _kept.get(volume.session_uid)
    if kept is None or scene.gridlight.error_goal() is not None:
        return False
    return kept.fits(grid_of(volume), scene.gridlight.bake_settings(), read_edits(scene, volume))


@persistent
def _file_goes(*_arguments) -> None:
    _kept.clear()


def attach() -> None:
    bpy.app.handlers.load_pre.append(_file_goes)


def detach() -> None:
    bpy.app.handlers.load_pre.remove(_file_goes)
    _kept.clear()
