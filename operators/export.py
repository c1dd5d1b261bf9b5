# SPDX-License-Identifier: GPL-3.0-or-later
"""Write baked light to files."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from ..core.errors import GridlightError
from ..core.field import Field
from ..formats import probe_file
from ..formats.export import ExportOptions, export
from ..formats.file_names import volume_endings
from ..formats.staging import StagedFolder
from ..scene.field_storage import load_field
from . import names
from .export_targets import PROBE_FILE
from .volume_choice import has_light, volumes_of

_BESIDE = "//gridlight"


class GRIDLIGHT_OT_export(bpy.types.Operator):
    """Write the baked light of all volumes into a folder. In a file that was never saved, the folder is asked for"""

    bl_idname = names.EXPORT
    bl_label = "Export"
    bl_options = {"REGISTER"}

    directory: StringProperty(
        name="Folder", description="Instead of the folder in the panel", subtype="DIR_PATH", options={"SKIP_SAVE"}
    )
    filter_folder: BoolProperty(default=True, options={"HIDDEN"})

    @classmethod
    def poll(cls, context):
        return has_light(cls, context)

    def invoke(self, context, _event):
        if not (self.directory or _folder(context.scene.gridlight.export)):
            self.directory = str(Path.home() / "")
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return self.execute(context)

    def execute(self, context):
        settings = context.scene.gridlight.export
        folder = Path(self.directory) if self.directory else _folder(settings)
        if folder is None:
            self.report({"ERROR"}, "The files go beside the .blend, which was never saved; save it or name a folder")
            return {"CANCELLED"}
        try:
            fields = [load_field(volume) for volume in volumes_of(context.scene)]
            written, warnings = _write([field for field in fields if field], settings, folder)
        except GridlightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        for warning in warnings:
            self.report({"WARNING"}, warning)
        self.report({"INFO"}, f"{written} files written to {folder}")
        return {"FINISHED"}


def _folder(settings) -> Path | None:
    """Where files go; None for beside a .blend that is not there."""
    chosen = settings.directory or _BESIDE
    if chosen.startswith("//") and not bpy.data.filepath:
        return None
    return Path(bpy.path.abspath(chosen))


def _write(fields: list[Field], settings, folder: Path) -> tuple[int, list[str]]:
    """Returns how many files were written, and what the user should know."""
    endings = volume_endings([field.grid.name for field in fields])
    if settings.target == PROBE_FILE:
        with StagedFolder(folder) as staged:
            for field, ending in zip(fields, endings):
                probe_file.write(staged.path(f"probes{ending}.exr"), field)
        return len(fields), []
    options = ExportOptions(
        scale=float(f"{settings.scale:.6g}"),
        gain=float(f"{settings.gain:.6g}"),
        window="auto" if settings.dering else "none",
    )
    written, warnings = 0, []
    for field, ending in zip(fields, endings):
        result = export(field, settings.target, folder / ending.lstrip("_") if ending else folder, options)
        written += len(result.files)
        warnings += [f"{field.grid.name}: {warning}" for warning in result.warnings]
    return written, warnings


classes = (GRIDLIGHT_OT_export,)
