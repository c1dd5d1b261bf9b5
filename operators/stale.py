# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether baked light still belongs to its scene.

The exact answer compares hashes, which means reading the whole scene. Edits only note that there was one; when they
have come to rest, and reading is quick, the answer is looked up, otherwise it waits for ``Check``.
"""

from __future__ import annotations

import time
from collections import Counter

import bpy
from bpy.app.handlers import persistent

from ..formats.probe_metadata import part_hashes
from ..scene.field_storage import has_moved, stored_details, stored_text
from ..scene.read import read_scene
from . import names
from .sidebar import redraw_sidebars
from .volume_choice import can_read_scene, volumes_of

FRESH, STALE, EDITED = "FRESH", "STALE", "EDITED"

_REST_SECONDS = 0.8  # after the last edit before the scene is read
_QUICK_SECONDS = 0.25  # more than this is not read without being asked
_LIGHTS_SCENE = (bpy.types.Object, bpy.types.Mesh, bpy.types.Light, bpy.types.Material, bpy.types.World)

_hashes: dict[int, dict[str, str]] = {}  # by part, of scenes as they are now, by session_uid
_edited: set[int] = set()  # scenes that may have changed since
_edits: Counter[int] = Counter()  # so far, by the scene's session_uid
_read_seconds: dict[int, float] = {}
_last_edit = 0.0  # time.monotonic()
_reading = False  # reading may update the depsgraph, which is no edit


def state_of(scene: bpy.types.Scene, volume: bpy.types.Object) -> str:
    """FRESH, STALE or EDITED (not compared since an edit) for a volume with light."""
    if has_moved(volume):
        return STALE
    now = _hashes.get(scene.session_uid)
    if scene.session_uid in _edited or now is None:
        return EDITED
    return STALE if _differing(volume, now) else FRESH


def changed_parts(scene: bpy.types.Scene, volume: bpy.types.Object) -> set[str]:
    """What of ``scene`` (``probe_metadata.LIGHTS`` …) is not as it was when the light of a STALE volume was baked."""
    return _differing(volume, _hashes.get(scene.session_uid, {}))


def _differing(volume: bpy.types.Object, now: dict[str, str]) -> set[str]:
    baked = stored_details(volume).get("viewport_hashes", {})
    return {part for part, value in now.items() if baked.get(part) != value}


def compare(scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer) -> None:
    """Reads ``scene`` and remembers its hashes."""
    started = time.perf_counter()
    global _reading
    _reading = True
    try:
        snapshot = read_scene(scene, view_layer, live=True)
    finally:
        _reading = False
    _hashes[scene.session_uid] = part_hashes(snapshot)
    _edited.discard(scene.session_uid)
    _read_seconds[scene.session_uid] = time.perf_counter() - started
    redraw_sidebars()


def edit_count(scene_uid: int) -> int:
    """A number that grows with every edit of a scene that may change its light; the scene by its ``session_uid``."""
    return _edits[scene_uid]


class GRIDLIGHT_OT_check_bake(bpy.types.Operator):
    """Compare the scene with the one that was baked"""

    bl_idname = names.CHECK_BAKE
    bl_label = "Check"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        return can_read_scene(cls, context)

    def execute(self, context):
        compare(context.scene, context.view_layer)
        stale = [
            volume.name
            for volume in volumes_of(context.scene)
            if stored_text(volume) and state_of(context.scene, volume) == STALE
        ]
        if stale:
            self.report(
                {"WARNING"}, f"The light of {', '.join(stale)} is of another state of the scene; bake or relight"
            )
        else:
            self.report({"INFO"}, "The baked light belongs to this scene")
        return {"FINISHED"}


@persistent
def _scene_edited(scene, depsgraph) -> None:
    global _last_edit
    if _reading or not any(isinstance(update.id, _LIGHTS_SCENE) for update in depsgraph.updates):
        return
    _edits[scene.session_uid] += 1
    if scene.session_uid in _edited:
        _last_edit = time.monotonic()
    else:
        note_edit(scene)


@persistent
def _file_loaded(*_arguments) -> None:
    """Another file, or an earlier state of this one: nothing is known any more."""
    forget()
    for window in bpy.context.window_manager.windows:
        note_edit(window.scene)


def note_edit(scene: bpy.types.Scene) -> None:
    """The scene may differ from what was baked in it, if anything was: it will be compared."""
    global _last_edit
    if any(stored_text(volume) for volume in volumes_of(scene)):
        _edited.add(scene.session_uid)
        _last_edit = time.monotonic()
        if not bpy.app.timers.is_registered(_look_when_at_rest):
            bpy.app.timers.register(_look_when_at_rest, first_interval=_REST_SECONDS)


def _look_when_at_rest() -> float | None:
    """The timer: compares what was edited once edits have come to rest."""
    waited = time.monotonic() - _last_edit
    if waited < _REST_SECONDS:
        return _REST_SECONDS - waited
    if bpy.app.is_job_running("RENDER"):
        return _REST_SECONDS
    for window in bpy.context.window_manager.windows:
        scene, screen = window.scene, window.screen
        if scene.session_uid not in _edited or screen.is_animation_playing:
            continue
        if _read_seconds.get(scene.session_uid, 0.0) <= _QUICK_SECONDS:
            compare(scene, window.view_layer)
    return None


def forget() -> None:
    """Drops what is known about scenes."""
    _hashes.clear()
    _edited.clear()
    _read_seconds.clear()


def attach() -> None:
    handlers = bpy.app.handlers
    handlers.depsgraph_update_post.append(_scene_edited)
    for after in (handlers.load_post, handlers.undo_post, handlers.redo_post):
        after.append(_file_loaded)


def detach() -> None:
    handlers = bpy.app.handlers
    handlers.depsgraph_update_post.remove(_scene_edited)
    for after in (handlers.load_post, handlers.undo_post, handlers.redo_post):
        after.remove(_file_loaded)
    if bpy.app.timers.is_registered(_look_when_at_rest):
        bpy.app.timers.unregister(_look_when_at_rest)
    forget()


classes = (GRIDLIGHT_OT_check_bake,)
