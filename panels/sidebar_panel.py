# SPDX-License-Identifier: GPL-3.0-or-later
"""What all panels of the tab have in common."""

from __future__ import annotations

import blf
import bpy

from ..operators.names import CATEGORY

_FONT = 0  # the interface's own
_LETTER_POINTS = 11
# Pixels at scale 1: what panels keep free at their sides, what an icon takes, and a button that shows no more than one.
_MARGIN, _ICON, _BUTTON = 58, 22, 32


class SidebarPanel:
    """Mix into a panel: puts it into Gridlight's tab of the 3D viewport's sidebar."""

    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = CATEGORY


def paragraph(
    layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE", buttons: int = 0
) -> None:
    """``text`` in as many lines as the sidebar's width asks for; labels do not wrap by themselves. ``buttons``: that
    follow in the same row, each with an icon alone."""
    scale = context.preferences.system.ui_scale
    width = context.region.width - scale * (_MARGIN + (_ICON if icon != "NONE" else 0) + _BUTTON * buttons)
    blf.size(_FONT, _LETTER_POINTS * scale)
    column = layout.column(align=True)
    column.scale_y = 0.8
    line = ""
    lines = []
    for word in text.split():
        if line and blf.dimensions(_FONT, f"{line} {word}")[0] > width:
            lines.append(line)
            line = word
        else:
            line = f"{line} {word}".strip()
    lines.append(line)
    for index, shown in enumerate(lines):
        column.label(text=shown, icon=icon if index == 0 else "BLANK1" if icon != "NONE" else "NONE")
