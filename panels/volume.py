# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes: where probes are, and how many."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.probe_states import invalid_in_words
from ..operators import names
from ..operators.libraries import library_of
from ..operators.volume_choice import active_volume, volumes_of
from ..scene import probe_objects
from ..scene.field_storage import has_moved, stored_counts, stored_invalid
from ..scene.volumes import resolution_of
from .sidebar_panel import SidebarPanel, paragraph


class GRIDLIGHT_PT_volume(SidebarPanel, bpy.types.Panel):
    bl_label = "Volume"
    bl_order = 0

    def draw(self, context):
        layout = self.layout
        volumes = volumes_of(context.scene)
        if not volumes:
            paragraph(layout, context, "A volume says where light probes stand. Add one, or look at the gallery.")
            column = layout.column()
            column.scale_y = 1.3
            column.operator(names.ADD_VOLUME, text="Add Volume", icon="LIGHTPROBE_VOLUME")
            column.operator(names.ADD_GALLERY, text="Add Gallery", icon="HOME")
            return
        active = active_volume(context)
        row = layout.row()
        if len(volumes) > 1:
            _list(row.column(align=True), volumes, active)
        else:
            row.label(text=active.name, icon="LIGHTPROBE_VOLUME")
        row.operator(names.ADD_VOLUME, text="", icon="ADD")
        if active is None:
            paragraph(layout, context, "Select a volume to see and change it", "INFO")
            return
        if library_of(active):
            paragraph(
                layout, context, f"From {library_of(active)}: to be changed and baked there", "LIBRARY_DATA_DIRECT"
            )
        _grid(layout, active)


class GRIDLIGHT_PT_probes(SidebarPanel, bpy.types.Panel):
    bl_label = "Probes"
    bl_parent_id = "GRIDLIGHT_PT_volume"
    bl_order = 1

    @classmethod
    def poll(cls, context):
        return bool(volumes_of(context.scene))

    def draw(self, context):
        layout = self.layout
        volume = active_volume(context)
        if volume is not None:
            _counts(layout, context, volume)
            _placed(layout, context, volume)
        row = layout.row(align=True)
        row.operator(names.PLACE_PROBES, text="Place", icon="EMPTY_AXIS")
        row.operator(names.RESET_PROBES, text="Reset", icon="LOOP_BACK")
        row.operator(names.CLEAR_PROBES, text="Clear", icon="X")


def _list(column, volumes, active) -> None:
    for volume in volumes:
        counts = " × ".join(map(str, resolution_of(volume)))
        chosen = volume == active
        button = column.operator(
            names.SELECT_VOLUME, text=f"{volume.name}   {counts}", icon="LIGHTPROBE_VOLUME", depress=chosen
        )
        button.volume = volume.name


def _grid(layout, volume) -> None:
    grid = volume.gridlight_grid
    title = layout.row()
    title.active = False
    title.label(text="Probes along each axis of the box")
    row = layout.row(align=True)
    for axis in range(3):
        row.prop(grid, "resolution", index=axis, text="XYZ"[axis])
    layout.prop(grid, "spacing")
    row = layout.row(align=True)
    for fit, title in (("SCENE", "Fit to Scene"), ("SELECTION", "To Selection")):
        row.operator(names.FIT_VOLUME, text=title).fit = fit


def _counts(layout, context, volume) -> None:
    """From the bake; before it, as far as placing tells."""
    scene = context.scene
    total = int(np.prod(resolution_of(volume)))
    counts = stored_counts(volume)
    placed = probe_objects.placed_count(scene, volume)
    grid = layout.grid_flow(row_major=True, columns=4, even_columns=True, align=True)
    if counts is None or has_moved(volume):
        known = {"total": f"{total}", "active": "–", "culled": "–", "invalid": "–"}
        if placed is not None and not probe_objects.stand_elsewhere(scene, volume):
            known |= {"active": f"{placed}", "culled": f"{total - placed}"}
    else:
        known = {name: f"{count}" for name, count in counts.items()}
    for name in known:
        cell = grid.column(align=True)
        cell.alignment = "CENTER"
        cell.label(text=known[name])
        sub = cell.column()
        sub.active = False
        sub.label(text=name)
    invalid = stored_invalid(volume)
    if invalid and known["invalid"] != "–":
        paragraph(layout, context, f"Invalid: {invalid_in_words(invalid)}", "INFO")


def _placed(layout, context, volume) -> None:
    scene = context.scene
    placed = probe_objects.placed_count(scene, volume)
    if placed is None:
        return
    if probe_objects.stand_elsewhere(scene, volume):
        paragraph(layout, context, "The probes stand where the volume was. Place them again", "ERROR")
        return
    if placed > probe_objects.OBJECT_LIMIT:
        text = f"{placed} probes are shown as points: more than {probe_objects.OBJECT_LIMIT} objects would be slow"
        paragraph(layout, context, text, "INFO")
        return
    edits = probe_objects.read_edits(scene, volume)
    if edits is None:
        layout.label(text=f"{placed} placed", icon="EMPTY_AXIS")
        return
    off, moved = int(edits.disabled.sum()), int(edits.offset.any(axis=1).sum())
    layout.label(text=f"{placed} placed, {off} switched off, {moved} moved", icon="EMPTY_AXIS")


classes = (GRIDLIGHT_PT_volume, GRIDLIGHT_PT_probes)
