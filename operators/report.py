# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of what is baked, in the browser."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.errors import GridlightError
from ..formats.probe_metadata import program_version
from ..formats.report import ReportData, VolumeReport, write_report
from ..scene.field_storage import load_field, stored_counts, stored_details, stored_text
from . import names
from .volume_choice import has_light, volumes_of


class GRIDLIGHT_OT_report(bpy.types.Operator):
    """Open a report of all baked volumes in the browser: figures, settings, warnings and the light in slices"""

    bl_idname = names.REPORT
    bl_label = "Open Report"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        return has_light(cls, context)

    def execute(self, context):
        baked = [volume for volume in volumes_of(context.scene) if stored_text(volume)]
        path = Path(bpy.app.tempdir) / "gridlight-report.html"
        try:
            write_report(path, _report(context.scene.name, baked))
        except (GridlightError, OSError) as error:
            self.report({"ERROR"}, f"the report cannot be made: {error}")
            return {"CANCELLED"}
        if not bpy.app.background:
            bpy.ops.wm.url_open(url=path.as_uri())
        self.report({"INFO"}, f"Report written to {path}")
        return {"FINISHED"}


def _report(title: str, volumes: list[bpy.types.Object]) -> ReportData:
    fields = [load_field(volume) for volume in volumes]
    details = [stored_details(volume) for volume in volumes]
    counts: dict[str, int] = {}
    seconds: dict[str, float] = {}
    warnings: list[str] = []
    for volume, field, detail in zip(volumes, fields, details):
        for name, count in stored_counts(volume).items():
            counts[name] = counts.get(name, 0) + count
        for phase, value in detail.get("seconds", {}).items():
            seconds[phase] = seconds.get(phase, 0.0) + value
        warnings += [warning for warning in field.metadata.get("warnings", []) if warning not in warnings]
    newest = fields[-1].metadata
    return ReportData(
        title=title,
        settings=newest.get("settings", {}),
        device=newest.get("device", ""),
        blender=bpy.app.version_string,
        generator=f"Gridlight {program_version()}",
        counts=counts,
        seconds=seconds,
        warnings=warnings,
        volumes=[
            VolumeReport(
                field,
                field.grid.name,
                detail.get("energy", []),
                detail.get("change", []),
                field.metadata.get("iterations", 0),
                field.metadata.get("converged", True),
                detail.get("notes", []),
                field.metadata.get("error"),
            )
            for field, detail in zip(fields, details)
        ],
    )


classes = (GRIDLIGHT_OT_report,)
