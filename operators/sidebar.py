# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar of 3D viewports, where Gridlight's panels are."""

from __future__ import annotations

import bpy

from . import names

_DRAWN_SECONDS = 0.05  # a sidebar that was closed knows its tabs only once it has been drawn
_MOST_TRIES = 20


def redraw_sidebars() -> None:
    """Has the sidebars of all 3D viewports drawn anew."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                _sidebar(area).tag_redraw()


def open_sidebar(area: bpy.types.Area) -> None:
    """Opens the sidebar of a 3D viewport and brings Gridlight's tab to the front as soon as it is there."""
    area.spaces.active.show_region_ui = True
    tries = 0

    def show_tab() -> float | None:
        nonlocal tries
        tries += 1
        areas = [item for window in bpy.context.window_manager.windows for item in window.screen.areas]
        if area not in areas:  # closed, or another file was loaded
            return None
        region = _sidebar(area)
        if region.active_panel_category != names.CATEGORY and tries < _MOST_TRIES:
            region.active_panel_category = names.CATEGORY
            region.tag_redraw()
            return _DRAWN_SECONDS
        return None

    bpy.app.timers.register(show_tab, first_interval=_DRAWN_SECONDS)


def _sidebar(area: bpy.types.Area) -> bpy.types.Region:
    return next(region for region in area.regions if region.type == "UI")
