# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview in the 3D viewport: on and off, and choosing probes by their spheres."""

from __future__ import annotations

import bpy

from ..core.conventions import ACTIVE
from ..core.probe_states import describe
from ..scene.probe_objects import INDEX_PROPERTY, VOLUME_PROPERTY
from . import names

_keymaps: list[tuple[bpy.types.KeyMap, bpy.types.KeyMapItem]] = []


class GRIDLIGHT_OT_preview(bpy.types.Operator):
    """Show direct light and baked light in the 3D viewport, or stop showing it"""

    bl_idname = names.PREVIEW
    bl_label = "Toggle Preview"

    def execute(self, context):
        preview = context.scene.gridlight.preview
        preview.enabled = not preview.enabled
        return {"FINISHED"}


class GRIDLIGHT_OT_pick_probe(bpy.types.Operator):
    """Select the probe whose sphere is under the mouse"""

    bl_idname = names.PICK_PROBE
    bl_label = "Select Probe"
    bl_options = {"UNDO"}

    extend: bpy.props.BoolProperty(
        name="Extend", description="Keep what is selected", default=False, options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        preview = context.scene.gridlight.preview
        return context.mode == "OBJECT" and context.region_data and preview.enabled and preview.show_probes

    def invoke(self, context, event):
        from ..viewport import handlers, picking  # draws, so only where there is a view

        session = handlers.request(context.scene)
        _, probes = handlers.shading_of(context.scene.gridlight.preview)
        if session.gpu is None:
            return {"PASS_THROUGH"}
        place = (event.mouse_region_x, event.mouse_region_y)
        found = picking.probe_at(context, session, probes, place)
        if found is None:
            return {"PASS_THROUGH"}
        volume, node = found
        field = session.gpu.fields[volume].field
        words = f"Probe {field.grid.coordinates(node)} of '{volume}': {describe(field, node)}"
        probe = probe_object(context.scene, volume, node)
        if probe is None:
            is_active = field.state[node] == ACTIVE
            self.report({"INFO"}, f"{words}. Place the volume's probes to edit it" if is_active else words)
            return {"CANCELLED"}
        self.report({"INFO"}, words)
        if not self.extend:
            for item in context.selected_objects:
                item.select_set(False)
        probe.select_set(True)
        context.view_layer.objects.active = probe
        return {"FINISHED"}


def probe_object(scene: bpy.types.Scene, volume: str, node: int) -> bpy.types.Object | None:
    """The Empty of a probe."""
    for item in scene.objects:
        if item.get(INDEX_PROPERTY) == node and item.get(VOLUME_PROPERTY) == volume:
            return item
    return None


def attach() -> None:
    """Clicks in the 3D viewport reach the spheres before they reach objects. Without a window there are no keys."""
    keyconfig = bpy.context.window_manager.keyconfigs.addon
    if keyconfig is None:
        return
    keymap = keyconfig.keymaps.new(name="Object Mode")
    for extend in (False, True):
        item = keymap.keymap_items.new(names.PICK_PROBE, "LEFTMOUSE", "PRESS", shift=extend, head=True)
        item.properties.extend = extend
        _keymaps.append((keymap, item))


def detach() -> None:
    for keymap, item in _keymaps:
        keymap.keymap_items.remove(item)
    _keymaps.clear()


classes = (GRIDLIGHT_OT_preview, GRIDLIGHT_OT_pick_probe)
