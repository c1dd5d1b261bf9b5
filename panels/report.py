# SPDX-License-Identifier: GPL-3.0-or-later
"""Report: what a bake was made of."""

from __future__ import annotations

import bpy

from ..operators import names
from ..operators.volume_choice import active_volume
from ..scene.field_storage import stored_details, stored_metadata
from .sidebar_panel import SidebarPanel, paragraph


class GRIDLIGHT_PT_report(SidebarPanel, bpy.types.Panel):
    bl_label = "Report"
    bl_order = 5
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        volume = active_volume(context)
        metadata = stored_metadata(volume) if volume else None
        if metadata is None:
            paragraph(layout, context, "Select a volume that is baked to read about its light", "INFO")
        else:
            _figures(layout, context, metadata, stored_details(volume))
        layout.operator(names.REPORT, icon="URL")


def _figures(layout, context, metadata: dict, details: dict) -> None:
    rows = [
        ("Bounces", str(details.get("bounces", "–"))),
        ("Settled", "yes" if metadata.get("converged") else "no, some light is still missing"),
        ("Frame", str(metadata.get("scene", {}).get("frame", "–"))),
    ]
    error = metadata.get("error") or {}
    if error.get("predicted") is not None:
        rows.append(("Error", f"{100 * error['predicted']:.1f} %, asked for {100 * error['target']:.3g} %"))
    rows += [(phase.capitalize(), f"{seconds:.2f} s") for phase, seconds in details.get("seconds", {}).items()]
    for name, value in rows:
        split = layout.split(factor=0.4)
        left = split.row()
        left.alignment = "RIGHT"
        left.active = False
        left.label(text=name)
        split.label(text=value)
    for warning in metadata.get("warnings", []):
        paragraph(layout, context, warning, "ERROR")


classes = (GRIDLIGHT_PT_report,)
