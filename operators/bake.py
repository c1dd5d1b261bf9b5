# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake volumes: at once from scripts, as a modal job that leaves Blender usable from the interface."""

from __future__ import annotations

import time

import bpy
from bpy.app.handlers import persistent
from bpy.props import BoolProperty

from .. import viewport
from ..core.errors import Cancelled, GridlightError
from ..scene.field_storage import remove_field, stored_text
from . import kept_bakes, names, stale
from .bake_task import BakeTask
from .libraries import cannot_keep
from .sidebar import redraw_sidebars
from .turns import Turns
from .volume_choice import can_read_scene, chosen_volumes, has_volume, in_object_mode, volumes_of

_INTERVAL_SECONDS = 0.01  # between two timer events

_running: _Job | None = None
_last_failure = ""


class _Job:
    """A task and everything in Blender that must be put back when it ends."""

    def __init__(self, task: BakeTask, context: bpy.types.Context):
        self.task = task
        self._manager = context.window_manager
        self._workspaces = [window.workspace for window in self._manager.windows]
        self._timer = self._manager.event_timer_add(_INTERVAL_SECONDS, window=context.window)
        self._turns = Turns()
        self._manager.progress_begin(0, 100)
        viewport.stand_still(True)
        for handlers in _interruptions():
            handlers.append(_interrupted)

    def work(self) -> None:
        """One turn.

        Raises:
            StopIteration: the task is done.
        """
        deadline = self._turns.begin()
        while time.perf_counter() < deadline:
            next(self.task)
        if self._turns.end():
            self._show()

    def _show(self) -> None:
        """Brings progress to cursor, status bar and panels."""
        progress = self.task.progress
        self._manager.progress_update(int(100 * progress.share))
        for workspace in self._workspaces:
            workspace.status_text_set(f"Gridlight: {progress}   |   Esc: cancel")
        redraw_sidebars()

    def end(self, failure: str) -> None:
        """Puts everything back; more than once does no harm. ``failure``: why it came to nothing, or empty."""
        global _running, _last_failure
        if _running is not self:
            return
        _running, _last_failure = None, failure
        self.task.close()
        viewport.stand_still(False)
        self._manager.event_timer_remove(self._timer)
        self._manager.progress_end()
        for workspace in self._workspaces:
            workspace.status_text_set(None)
        for handlers in _interruptions():
            handlers.remove(_interrupted)
        redraw_sidebars()


class _BakesVolumes:
    """What bakes and relights have in common; mix into an operator."""

    bl_options = {"UNDO"}
    relights = False

    @classmethod
    def poll(cls, context):
        if not can_read_scene(cls, context):
            return False
        if _running is not None:
            cls.poll_message_set("A bake is running; wait, or cancel it")
            return False
        return has_volume(cls, context)

    def _task(self, context) -> BakeTask:
        chosen = chosen_volumes(context, self.everything)
        return BakeTask(context.scene, context.view_layer, chosen, self.relights)

    def execute(self, context):
        """Bakes to the end before it returns."""
        global _last_failure
        _last_failure = ""
        try:
            task = self._task(context)
            for _ in task:
                pass
        except GridlightError as error:
            return self._failed(error)
        return self._finished(context, task)

    def invoke(self, context, _event):
        global _running
        try:
            task = self._task(context)
        except GridlightError as error:
            return self._failed(error)
        self._job = _running = _Job(task, context)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job = self._job
        if _running is not job:  # ended from outside, and this is the first event since
            return {"CANCELLED", "PASS_THROUGH"}
        if event.type == "ESC" and event.value == "PRESS":
            job.task.stop("The bake was cancelled; everything is as it was")
        elif event.type != "TIMER" and not job.task.stopped:
            return {"PASS_THROUGH"}
        if context.mode != "OBJECT":
            job.task.stop("The bake was given up, because the mode was changed")
        job.task.check()
        try:
            job.work()
        except StopIteration:
            job.end("")
            return self._finished(context, job.task)
        except GridlightError as error:
            job.end(str(error))
            return self._failed(error)
        except Exception:  # a bug: it must not leave timer and status text behind, and goes on to Blender's console
            job.end("The bake failed; the console says more")
            raise
        return {"RUNNING_MODAL"} if event.type == "ESC" else {"PASS_THROUGH"}

    def cancel(self, _context):
        """Blender ends the operator itself: its window was closed."""
        self._job.task.stop("The bake was given up, because its window was closed")
        self._job.end("The bake was given up, because its window was closed")

    def _finished(self, context, task: BakeTask) -> set[str]:
        for warning in task.progress.warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, task.outcome)
        for volume in volumes_of(context.scene):
            viewport.field_changed(volume)
        if not bpy.app.background:
            stale.note_edit(context.scene)  # it may have been edited while it was baked
        return {"FINISHED"}

    def _failed(self, error: GridlightError) -> set[str]:
        self.report({"INFO"} if isinstance(error, Cancelled) else {"ERROR"}, str(error))
        return {"CANCELLED"}


class GRIDLIGHT_OT_bake(_BakesVolumes, bpy.types.Operator):
    """Bake the light of the active volume, or of all volumes. Blender stays usable; Esc cancels and leaves everything
    as it was"""

    bl_idname = names.BAKE
    bl_label = "Bake"

    everything: BoolProperty(name="All Volumes", description="Bake every volume, not only the active one")


class GRIDLIGHT_OT_relight(_BakesVolumes, bpy.types.Operator):
    """Follow what changed since the last bake without doing the rest again: lamps take a fraction of a bake, moved
    objects only probes that see them"""

    bl_idname = names.RELIGHT
    bl_label = "Relight"
    relights = True

    everything: BoolProperty(name="All Volumes", description="Relight every volume, not only the active one")

    @classmethod
    def poll(cls, context):
        if not super().poll(context):
            return False
        try:
            chosen = chosen_volumes(context)
        except GridlightError as error:
            cls.poll_message_set(str(error))
            return False
        if not any(kept_bakes.is_kept(volume.session_uid) for volume in chosen):
            cls.poll_message_set("A relight goes on from a bake that is still on the GPU; bake first")
            return False
        return True


class GRIDLIGHT_OT_cancel_bake(bpy.types.Operator):
    """Stop the running bake and leave everything as it was"""

    bl_idname = names.CANCEL_BAKE
    bl_label = "Cancel"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, _context):
        if _running is None:
            cls.poll_message_set("No bake is running")
        return _running is not None

    def execute(self, _context):
        _running.task.stop("The bake was cancelled; everything is as it was")
        return {"FINISHED"}


class GRIDLIGHT_OT_clear_bake(bpy.types.Operator):
    """Forget the light of the active volume, or of all volumes, that is stored in this file"""

    bl_idname = names.CLEAR_BAKE
    bl_label = "Clear Bake"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        if not in_object_mode(cls, context):
            return False
        baked = [volume for volume in volumes_of(context.scene) if stored_text(volume)]
        if not baked:
            cls.poll_message_set("Nothing is baked: there is no light to clear")
        elif all(reasons := [cannot_keep(volume) for volume in baked]):
            cls.poll_message_set(reasons[0])
        else:
            return True
        return False

    def execute(self, context):
        try:
            chosen = chosen_volumes(context)
        except GridlightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for volume in chosen:
            remove_field(volume)
            viewport.field_changed(volume)
        return {"FINISHED"}


def running_task() -> BakeTask | None:
    """The bake that runs now."""
    return _running.task if _running is not None else None


def last_failure() -> str:
    """In one line why the last bake of this session came to nothing; empty if it did not."""
    return _last_failure


def stop_running(reason: str) -> None:
    """Ends a running bake at once, if there is one."""
    if _running is not None:
        _running.task.stop(reason)
        _running.end(reason)


@persistent  # loading a file removes other handlers before they could tell
def _interrupted(*_arguments) -> None:
    stop_running("The bake was given up, because the file changed under it")


def _interruptions() -> tuple[list, ...]:
    handlers = bpy.app.handlers
    return handlers.load_pre, handlers.undo_pre, handlers.redo_pre


classes = (GRIDLIGHT_OT_bake, GRIDLIGHT_OT_relight, GRIDLIGHT_OT_cancel_bake, GRIDLIGHT_OT_clear_bake)
