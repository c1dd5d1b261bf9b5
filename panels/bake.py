# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake: quality, the button, how far it is, and what came of it."""

from __future__ import annotations

import bpy

from ..formats.probe_metadata import LIGHTS, WORLD
from ..operators import names
from ..operators.bake import last_failure, running_task
from ..operators.kept_bakes import goes_on
from ..operators.libraries import library_of
from ..operators.quality import QUALITIES
from ..operators.stale import EDITED, STALE, changed_parts, state_of
from ..operators.volume_choice import active_volume, volumes_of
from ..scene.field_storage import has_moved, stored_details, stored_metadata, unreadable
from .sidebar_panel import SidebarPanel, paragraph


class GRIDLIGHT_PT_bake(SidebarPanel, bpy.types.Panel):
    bl_label = "Bake"
    bl_order = 1

    def draw(self, context):
        layout = self.layout
        settings = context.scene.gridlight
        row = layout.row(align=True)
        row.active = not settings.use_error
        row.prop(settings, "quality", expand=True)
        quality = QUALITIES.get(settings.quality)
        row = layout.row(align=True)
        row.prop(settings, "use_error", text="")
        target = row.row(align=True)
        target.active = settings.use_error
        target.prop(settings, "target_error_percent")
        task = running_task()
        row = layout.row()
        row.active = False
        if task is not None:
            row.label(text=task.progress.which or "Esc cancels and leaves everything as it was")
        elif settings.use_error:
            row.label(text="Settings are chosen for this error")
        elif quality:
            row.label(text=f"{quality.error_percent:.1f} % off path tracing in the gallery")
        else:
            row.label(text="Error of these settings: not measured")
        row = layout.row(align=True)
        row.scale_y = 1.5
        if task is not None:
            _running(row, task)
        else:
            _buttons(row, context)
        _state(layout, context)


class GRIDLIGHT_PT_bake_settings(SidebarPanel, bpy.types.Panel):
    bl_label = "Settings"
    bl_parent_id = "GRIDLIGHT_PT_bake"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        settings = context.scene.gridlight
        if running_task() is not None:
            paragraph(layout, context, "A bake is running with these; they can be changed when it is done", "INFO")
            layout.enabled = False
        column = layout.column()
        column.prop(settings, "bands")
        _chosen(column, settings, "face")
        _chosen(column, settings, "samples")
        column.prop(settings, "gather")
        column = layout.column(heading="Bounces")
        column.prop(settings, "bounces_auto", text="Until Settled")
        if settings.bounces_auto:
            _chosen(column, settings, "tolerance")
        else:
            column.prop(settings, "bounces")
        column = layout.column()
        column.prop(settings, "capture")
        column.prop(settings, "seed")
        column.prop(settings, "memory_mib")
        column.prop(settings, "keep_all")
        column.prop(settings, "deringing")


def _chosen(column, settings, name: str) -> None:
    """A setting that a target error chooses: dim where there is one."""
    row = column.row()
    row.active = not settings.use_error
    row.prop(settings, name)


def _buttons(row, context) -> None:
    row.operator(names.BAKE, icon="RENDER_STILL")
    if len(volumes_of(context.scene)) > 1:
        row.operator(names.BAKE, text="Bake All").everything = True
    row.operator(names.RELIGHT, icon="LIGHT")


def _running(row, task) -> None:
    """In place of the buttons, and as high as they are: nothing below moves."""
    split = row.split(factor=0.75, align=True)
    split.progress(factor=task.progress.share, text=task.progress.what)
    split.operator(names.CANCEL_BAKE)


def _state(layout, context) -> None:
    """Whether there is light, and whether it still belongs to the scene."""
    volume = active_volume(context)
    metadata = stored_metadata(volume) if volume else None
    if metadata is None:
        reason = unreadable(volume) if volume else ""
        if reason:
            row = layout.row()
            paragraph(row, context, _sentence(reason), "ERROR", buttons=1)
            row.operator(names.CLEAR_BAKE, text="", icon="TRASH")
        if last_failure():
            paragraph(layout, context, _sentence(last_failure()), "INFO")
        return
    state = state_of(context.scene, volume)
    row = layout.row()
    if has_moved(volume):
        paragraph(row, context, "The volume has changed since the bake. Bake again", "ERROR", buttons=1)
    elif state == STALE:
        library = library_of(volume)
        again = f"Bake in {library}" if library else "Bake again"
        remedy = "Relight" if goes_on(context.scene, volume) else again
        paragraph(row, context, f"{_what_changed(context.scene, volume)} since the bake. {remedy}", "ERROR", buttons=1)
    elif state == EDITED:
        row.label(text="Edited since the bake", icon="QUESTION")
        # In the same row: this state passes by itself, and nothing below must move under a click.
        row.operator(names.CHECK_BAKE, text="", icon="FILE_REFRESH")
    else:
        row.label(text="The light is up to date", icon="CHECKMARK")
    row.operator(names.CLEAR_BAKE, text="", icon="TRASH")
    if last_failure():
        paragraph(layout, context, _sentence(last_failure()), "INFO")
    else:
        paragraph(layout, context, stored_details(volume).get("outcome", ""), "BLANK1")
    warnings = len(metadata.get("warnings", []))
    if warnings:
        text = "1 warning: see Report" if warnings == 1 else f"{warnings} warnings: see Report"
        layout.label(text=text, icon="ERROR")


def _sentence(text: str) -> str:
    """Errors begin with a small letter: on the command line they stand behind the program's name."""
    return text[0].upper() + text[1:]


def _what_changed(scene, volume) -> str:
    parts = changed_parts(scene, volume)
    for part, text in ((LIGHTS, "Lights have changed"), (WORLD, "The world has changed")):
        if parts == {part}:
            return text
    return "The scene has changed"


classes = (GRIDLIGHT_PT_bake, GRIDLIGHT_PT_bake_settings)
