# SPDX-License-Identifier: GPL-3.0-or-later
"""Preview: the baked light in the 3D viewport."""

from __future__ import annotations

import bpy

from ..operators import names
from ..operators.volume_choice import volumes_of
from ..scene.field_storage import stored_text
from .sidebar_panel import SidebarPanel, paragraph


class GRIDLIGHT_PT_preview(SidebarPanel, bpy.types.Panel):
    bl_label = "Preview"
    bl_order = 3

    def draw(self, context):
        layout = self.layout
        preview = context.scene.gridlight.preview
        row = layout.row()
        row.scale_y = 1.3
        row.prop(
            preview,
            "enabled",
            toggle=True,
            text="Preview On" if preview.enabled else "Preview",
            icon="HIDE_OFF" if preview.enabled else "HIDE_ON",
        )
        layout.operator(names.EXPLORE, icon="VIEW_PERSPECTIVE")
        if not any(stored_text(volume) for volume in volumes_of(context.scene)):
            paragraph(layout, context, "Nothing is baked yet: only direct light will be seen", "INFO")
        if not preview.enabled:
            return
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.prop(preview, "mode")
        column.prop(preview, "exposure")
        column.prop(preview, "tone_curve")
        column.prop(preview, "indirect", slider=True)
        column.prop(preview, "highlight", slider=True)


class GRIDLIGHT_PT_preview_probes(SidebarPanel, bpy.types.Panel):
    bl_label = "Probe Spheres"
    bl_parent_id = "GRIDLIGHT_PT_preview"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.scene.gridlight.preview.enabled

    def draw_header(self, context):
        self.layout.prop(context.scene.gridlight.preview, "show_probes", text="")

    def draw(self, context):
        layout = self.layout
        preview = context.scene.gridlight.preview
        layout.use_property_split = True
        layout.use_property_decorate = False
        layout.active = preview.show_probes
        layout.prop(preview, "probe_size")
        layout.prop(preview, "probe_shading")


class GRIDLIGHT_PT_preview_live(SidebarPanel, bpy.types.Panel):
    bl_label = "Live Updates"
    bl_parent_id = "GRIDLIGHT_PT_preview"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.scene.gridlight.preview.enabled

    def draw_header(self, context):
        self.layout.prop(context.scene.gridlight.preview, "live", text="")

    def draw(self, context):
        layout = self.layout
        preview = context.scene.gridlight.preview
        layout.use_property_split = True
        layout.use_property_decorate = False
        column = layout.column()
        column.active = preview.live
        column.prop(preview, "frame_budget_ms", text="Budget (ms)")
        layout.prop(preview, "show_rate")


classes = (GRIDLIGHT_PT_preview, GRIDLIGHT_PT_preview_probes, GRIDLIGHT_PT_preview_live)
