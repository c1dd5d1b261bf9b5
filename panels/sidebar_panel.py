# SPDX-License-Identifier: GPL-3.0-or-later
"""What all panels of the tab have in common."""

from __future__ import annotations

import bpy

from ..operators.names import CATEGORY

_LINE_PIXELS = 7  # of one letter at scale 1, on average
_MARGIN_PIXELS = 60


class SidebarPanel:
    """Mix into a panel: puts it into Gridlight's tab of the 3D viewport's sidebar."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = CATEGORY


def paragraph(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """``text`` in as many lines as the sidebar's width asks for; labels do not wrap by themselves."""
    letters = max(int((context.region.width / context.preferences.system.ui_scale - _MARGIN_PIXELS) / _LINE_PIXELS), 16)
    column = layout.column(align=True)
    column.scale_y = 0.8
    line = ""
    lines = []
    for word in text.split():
        if line and len(line) + 1 + len(word) > letters:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    lines.append(line)
    for index, shown in enumerate(lines):
        column.label(text=shown, icon=icon if index == 0 else "BLANK1" if icon != "NONE" else "NONE")
