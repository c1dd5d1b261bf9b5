# SPDX-License-Identifier: GPL-3.0-or-later
"""Lights: every light with its role, its group and its intensity."""

from __future__ import annotations

import bpy

from ..operators import names
from ..operators.libraries import library_of
from ..scene.lights import GROUP_PROPERTY, is_dynamic
from .sidebar_panel import SidebarPanel, paragraph

_ICONS = {"POINT": "LIGHT_POINT", "SUN": "LIGHT_SUN", "SPOT": "LIGHT_SPOT", "AREA": "LIGHT_AREA"}
_WIDE = 400  # pixels; below, the group is only shown for the light that is chosen


class GRIDLIGHT_UL_lights(bpy.types.UIList):
    """Light objects of the scene, and objects that glow and belong to a group."""

    def draw_item(self, context, layout, _data, item, _icon, _active_data, _active_property, _index, _flag):
        light = item.gridlight_light
        glows = item.type != "LIGHT"
        wide = context.region.width > _WIDE
        split = layout.split(factor=0.5 if wide else 0.75)
        split.label(text=item.name, icon="LIGHT_HEMI" if glows else _ICONS[item.data.type])
        row = split.row(align=True)
        if wide:
            row.prop(light, "group", text="", emboss=False)
        row.prop(light, "intensity", text="", emboss=False)

    def filter_items(self, _context, data, name):
        helper = bpy.types.UI_UL_list
        objects = getattr(data, name)
        shown = [self.bitflag_filter_item if is_listed(item) else 0 for item in objects]
        if self.filter_name:
            named = helper.filter_items_by_name(self.filter_name, self.bitflag_filter_item, objects, "name")
            shown = [flag & other for flag, other in zip(shown, named)]
        return shown, helper.sort_items_by_name(objects, "name") if self.use_filter_sort_alpha else []


class GRIDLIGHT_PT_lights(SidebarPanel, bpy.types.Panel):
    bl_label = "Lights"
    bl_order = 2
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        layout = self.layout
        scene = context.scene
        if not any(is_listed(item) for item in scene.objects):
            paragraph(layout, context, "No lights. Lamps appear here; objects that glow do so once they have a group")
            return
        layout.template_list(
            names.LIGHT_LIST, "", scene, "objects", scene.gridlight, "active_light", rows=4, item_dyntip_propname="name"
        )
        index = scene.gridlight.active_light
        item = scene.objects[index] if 0 <= index < len(scene.objects) else None
        if item is None or not is_listed(item):
            paragraph(layout, context, "Choose a light in the list to see its role", "INFO")
            return
        layout.use_property_split = True
        layout.use_property_decorate = False
        light = item.gridlight_light
        if library_of(item):
            paragraph(layout, context, f"From {library_of(item)}: to be changed there", "LIBRARY_DATA_DIRECT")
        column = layout.column()
        column.prop(light, "role")
        column.prop(light, "group")
        column.prop(light, "intensity")
        column.prop(light, "animate")
        if item.type == "LIGHT" and light.role == "STATIC" and is_dynamic(item):
            paragraph(layout, context, "It is animated, so it is treated as dynamic", "INFO")


def is_listed(item: bpy.types.Object) -> bool:
    """Light objects, and others that were given a light group."""
    return item.type == "LIGHT" or bool(item.get(GROUP_PROPERTY))


classes = (GRIDLIGHT_UL_lights, GRIDLIGHT_PT_lights)
