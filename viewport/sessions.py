# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes as views show them: read once, kept on the GPU, and brought up to date from a timer.

Draw callbacks must not evaluate anything, so they only ask for a session and draw what it has; reading and relighting
happen in ``update`` and ``relight``, which the timer of handlers.py calls. A session lives as long as some view of its
scene shows Gridlight's light.
"""

from __future__ import annotations

import time
from dataclasses import replace

import bpy

from ..core.errors import GridlightError
from ..core.field import Field
from ..core.snapshot import SceneSnapshot
from ..gpu_shaders.live_field import LiveField
from ..scene.notices import Notices
from ..scene.probe_objects import read_edits
from ..scene.read import read_lights, read_scene
from ..scene.world import read_world
from .changes import FIELDS, LIGHTS, SURFACES, WORLD
from .fade import Fade
from .gpu_scene import GpuScene
from .live_bake import LiveBake, Progress, Target
from .readout import Readout

_PATIENCE = 3.0  # times the duration of a read: how long a scene must stand still before it is read again
_QUICK_SECONDS = 0.03  # a read this short may happen in every frame


class SceneSession:
    """One scene on the GPU. ``version`` counts up whenever pictures of it would look different."""

    def __init__(self, scene: bpy.types.Scene):
        self._uid = scene.session_uid
        self.version = 0
        self.updates = 0  # of the depsgraph: visibility may have changed
        self.message = ""  # why there is nothing to see
        self.shown_settings: tuple = ()
        self.readout = Readout()
        self._live = LiveBake()
        self._live_fields: dict[str, Field] = {}  # what it found since the last bake was stored
        self._leads: dict[str, LiveField] = {}  # bring shown fields to where live light is
        self._fade = Fade()
        self.gpu: GpuScene | None = None  # None before the first read, and for scenes without surface
        self.snapshot: SceneSnapshot | None = None
        self._pending = {SURFACES}
        self._changed_at = 0.0
        self._light_is_old = False
        self._read_seconds = 0.0

    @property
    def scene(self) -> bpy.types.Scene | None:
        """The scene, None once it is deleted."""
        return next((scene for scene in bpy.data.scenes if scene.session_uid == self._uid), None)

    def mark(self, kinds: set[str]) -> None:
        """Something changed; ``update`` will see to it."""
        self.updates += 1
        if kinds:
            self._pending |= kinds
            self._changed_at = time.perf_counter()
            if kinds - {FIELDS}:
                self.readout.changed(self._changed_at)
                self._light_is_old = True

    @property
    def is_pending(self) -> bool:
        return bool(self._pending)

    def update(self, scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
        """Reads what changed, unless the scene is still moving and reading it would stop the movement."""
        if not self._pending:
            return
        still = time.perf_counter() - self._changed_at
        slow = SURFACES in self._pending and self._read_seconds > _QUICK_SECONDS
        if slow and self.gpu is not None and still < _PATIENCE * self._read_seconds:
            return
        kinds, self._pending = self._pending, set()
        if FIELDS in kinds:
            self._live_fields = {}
        try:
            if SURFACES in kinds or self.gpu is None:
                self._read_everything(scene, view_layer)
            else:
                self._read_part(kinds, scene, view_layer)
            self.message = "" if self.gpu else "no surface to show: add a mesh"
        except (GridlightError, RuntimeError) as error:  # unreadable field or scene, or Blender is rendering
            self.message = str(error)
        self.version += 1

    def relight(self, scene: bpy.types.Scene, budget_seconds: float) -> None:
        """Lets the light of volumes that were baked follow what changed since, for about ``budget_seconds``."""
        if self.gpu is None or not self.gpu.fields or self._pending:
            return
        live = self._live
        if self._light_is_old:
            targets = [
                Target(item.field.grid, read_edits(scene, scene.objects[name]))
                for name, item in self.gpu.fields.items()
                if name in scene.objects
            ]
            live.follow(self.snapshot, targets, scene.gridlight.bake_settings(), self._changed_at)
            self._light_is_old = False
        if live.is_working:
            settles = live.is_settling
            progress = live.step(budget_seconds)
            if not settles:
                self.readout.worked(progress.probes)
            self._show(progress)
        if self._fade.is_on:
            share = self._fade.share()
            for lead in self._leads.values():
                lead.follow(share)
            self.version += 1
        elif live.is_rough:
            live.settle()

    def _show(self, progress: Progress) -> None:
        """Brings new light to the views, or on its way there."""
        if self._live.message:
            self.message = self._live.message
        if progress.probes:
            self._fade.restart()
        if progress.fields:
            self._live_fields |= progress.fields
            self.gpu.show_fields(progress.fields, with_old_light=not progress.is_settled)
            for name in progress.fields:
                backend = self._live.backend_of(name)
                self._leads.pop(name, None)
                if backend is not None:
                    self._leads[name] = LiveField(backend, self.gpu.fields[name])
            self.version += 1
        self.readout.shows(self._live.shown_moment)

    @property
    def is_relighting(self) -> bool:
        """Whether ``relight`` has something to do."""
        busy = self._live.is_working or self._live.is_rough or self._light_is_old or self._fade.is_on
        return self.gpu is not None and bool(self.gpu.fields) and busy

    def _forget_leads(self) -> None:
        """What is shown was replaced: live light must come as a whole before it can lead again."""
        self._leads.clear()
        self._live.show_whole()

    def _read_part(self, kinds: set[str], scene, view_layer) -> None:
        if LIGHTS in kinds:
            self.snapshot = replace(self.snapshot, lights=read_lights(scene, view_layer))
            self.gpu.set_lights(self.snapshot.lights)
        if WORLD in kinds:
            self.snapshot = replace(self.snapshot, world=read_world(scene, Notices()))
            self.gpu.set_world(self.snapshot.world)
        if FIELDS in kinds:
            self._forget_leads()
            self.gpu.load_fields(scene)
            self._light_is_old = False
            self.readout.forget_changes()

    def _read_everything(self, scene, view_layer) -> None:
        started = time.perf_counter()
        self._forget_leads()
        self.gpu = None
        self.snapshot = read_scene(scene, view_layer, live=True)
        if len(self.snapshot.triangles):
            self.gpu = GpuScene(scene, self.snapshot)
            kept = {name: field for name, field in self._live_fields.items() if name in self.gpu.fields}
            if kept:
                self.gpu.show_fields(kept)
        self._read_seconds = time.perf_counter() - started


_sessions: dict[int, SceneSession] = {}


def session_of(scene: bpy.types.Scene) -> SceneSession:
    """The session of ``scene``, new where there is none."""
    if scene.session_uid not in _sessions:
        _sessions[scene.session_uid] = SceneSession(scene)
    return _sessions[scene.session_uid]


def existing() -> list[SceneSession]:
    return list(_sessions.values())


def mark_all(kind: str) -> None:
    for session in _sessions.values():
        session.mark({kind})


def drop(session: SceneSession) -> None:
    """Frees what the session has on the GPU."""
    _sessions.pop(session._uid, None)


def drop_all() -> None:
    _sessions.clear()
