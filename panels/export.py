# SPDX-License-Identifier: GPL-3.0-or-later
"""Export: baked light as files."""

from __future__ import annotations

import bpy

from ..operators import names
from ..operators.export_targets import PROBE_FILE, does_not_carry
from .sidebar_panel import SidebarPanel, paragraph


class GRIDLIGHT_PT_export(SidebarPanel, bpy.types.Panel):
    bl_label = "Export"
    bl_order = 4

    def draw(self, context):
        layout = self.layout
        settings = context.scene.gridlight.export
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.prop(settings, "target")
        column.prop(settings, "directory", placeholder="beside the .blend")
        row = layout.row()
        row.scale_y = 1.3
        row.operator(names.EXPORT, icon="EXPORT")


class GRIDLIGHT_PT_export_options(SidebarPanel, bpy.types.Panel):
    bl_label = "Options"
    bl_parent_id = "GRIDLIGHT_PT_export"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.scene.gridlight.export.target != PROBE_FILE

    def draw(self, context):
        layout = self.layout
        settings = context.scene.gridlight.export
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.prop(settings, "scale")
        column.prop(settings, "gain")
        column.prop(settings, "dering")
        losses = does_not_carry(settings.target)
        if losses:
            layout.label(text="This format does not carry")
            for loss in losses:
                paragraph(layout, context, loss, "DOT")


classes = (GRIDLIGHT_PT_export, GRIDLIGHT_PT_export_options)
