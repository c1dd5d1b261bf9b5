# SPDX-License-Identifier: GPL-3.0-or-later
"""Bring a probe file into the scene: a volume with its light, to look at a bake that was made elsewhere."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty

from .. import viewport
from ..core.errors import GridlightError
from ..formats import probe_file
from ..scene.field_storage import store_field
from ..scene.volumes import create_volume
from . import names
from .volume_choice import in_object_mode


class GRIDLIGHT_OT_import_field(bpy.types.Operator):
    """Add a volume with the light of a probe file (.exr), for the preview and for export"""

    bl_idname = names.IMPORT
    bl_label = "Import Probe File"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(name="Probe File", subtype="FILE_PATH", options={"SKIP_SAVE"})
    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        path = Path(bpy.path.abspath(self.filepath))
        try:
            field = probe_file.read(path)
        except (GridlightError, OSError) as error:  # OSError: no such file, or not allowed to read it
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        grid = field.grid
        volume = create_volume(context.scene, grid.name, grid.matrix, grid.resolution)
        context.view_layer.update()
        store_field(volume, field, field.metadata.get("scene_hash", ""))
        context.view_layer.objects.active = volume
        viewport.field_changed(volume)
        self.report({"INFO"}, f"{grid.count} probes from {path.name}")
        return {"FINISHED"}


classes = (GRIDLIGHT_OT_import_field,)
