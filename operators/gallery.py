# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo gallery as a scene of its own."""

from __future__ import annotations

import bpy

from ..scene.gallery import build_gallery
from . import names
from .sidebar import open_sidebar
from .volume_choice import in_object_mode, volumes_of


class GRIDLIGHT_OT_add_gallery(bpy.types.Operator):
    """Add a small museum with lights, light groups and a probe volume, as a scene of its own, and look at it through
    its camera"""

    bl_idname = names.ADD_GALLERY
    bl_label = "Gridlight Gallery"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def execute(self, context):
        scene = build_gallery()
        volume = volumes_of(scene)[0]
        scene.view_layers[0].objects.active = volume
        window = context.window
        if window is None:  # without a window there is nothing to look with
            self.report({"INFO"}, f"Scene '{scene.name}' was added")
            return {"FINISHED"}
        window.scene = scene
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.spaces.active.region_3d.view_perspective = "CAMERA"
                open_sidebar(area)
        return {"FINISHED"}


classes = (GRIDLIGHT_OT_add_gallery,)
