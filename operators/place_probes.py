# SPDX-License-Identifier: GPL-3.0-or-later
"""Show where a bake will sample the light: probes as Empties, without those that light nothing."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import BoolProperty

from .. import viewport
from ..core.conventions import ACTIVE, CULLED
from ..core.culling import needed_nodes
from ..core.errors import GridlightError, InputError
from ..scene import probe_objects
from ..scene.read import read_scene
from . import names
from .volume_choice import can_read_scene, chosen_volumes, grid_of, has_volume, in_object_mode, volumes_of


class GRIDLIGHT_OT_place_probes(bpy.types.Operator):
    """Place an Empty at every probe that lights some surface: of the active volume, or of all volumes. Delete one to
    switch its probe off, move one to capture from another place within its cell"""

    bl_idname = names.PLACE_PROBES
    bl_label = "Place Probes"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return can_read_scene(cls, context) and has_volume(cls, context)

    def execute(self, context):
        scene = context.scene
        try:
            chosen = chosen_volumes(context)
            snapshot = read_scene(scene, context.view_layer)
            if not len(snapshot.triangles):
                raise InputError(f"scene '{scene.name}' has no surface to light; add a mesh first")
            states = [_place(scene, volume, snapshot.triangle_positions) for volume in chosen]
        except GridlightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        probe_objects.forget_lost_volumes(scene)
        active = int(sum((state == ACTIVE).sum() for state in states))
        total = sum(len(state) for state in states)
        text = f"{active} of {total} probes placed; {total - active} light nothing and are culled"
        if any((state == ACTIVE).sum() > probe_objects.OBJECT_LIMIT for state in states):
            text += f". More than {probe_objects.OBJECT_LIMIT} in a volume are shown as points, not as objects"
        viewport.sync(scene)
        self.report({"INFO"}, text)
        return {"FINISHED"}


class GRIDLIGHT_OT_clear_probes(bpy.types.Operator):
    """Remove all probe Empties from the scene and forget what was done to them; volumes and baked light stay"""

    bl_idname = names.CLEAR_PROBES
    bl_label = "Clear Probes"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and _are_placed(cls, context)

    def execute(self, context):
        count = probe_objects.clear_probes(context.scene)
        self.report({"INFO"}, f"{count} probes removed")
        return {"FINISHED"}


class GRIDLIGHT_OT_reset_probes(bpy.types.Operator):
    """Bring probes back to where their grid has them; deleted ones too, unless only selected probes are reset"""

    bl_idname = names.RESET_PROBES
    bl_label = "Reset Probes"
    bl_options = {"REGISTER", "UNDO"}

    selected: BoolProperty(
        name="Selected Only", description="Only probes that are selected, which leaves deleted ones deleted"
    )

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and _are_placed(cls, context)

    def execute(self, context):
        scene = context.scene
        count = 0
        for volume in volumes_of(scene):
            edits = probe_objects.read_edits(scene, volume)
            if edits is None:
                continue
            count += probe_objects.reset(scene, volume, only=set(context.selected_objects) if self.selected else None)
        self.report({"INFO"}, f"{count} probes are back in their places")
        return {"FINISHED"}


def _are_placed(operator, context: bpy.types.Context) -> bool:
    """For ``poll``: there are placed probes, or a line that says so."""
    if probe_objects.any_placed(context.scene):
        return True
    operator.poll_message_set("No probes are placed; place them first")
    return False


def _place(scene: bpy.types.Scene, volume: bpy.types.Object, triangles: np.ndarray) -> np.ndarray:
    """Culls and places one volume, keeping what the user did to its probes; returns its states (P,)."""
    grid = grid_of(volume)
    edits = probe_objects.read_edits(scene, volume)
    state = np.where(needed_nodes(grid, triangles), ACTIVE, CULLED).astype(np.uint8)
    probe_objects.place_probes(scene, grid, state, volume, edits)
    return state


classes = (GRIDLIGHT_OT_place_probes, GRIDLIGHT_OT_clear_probes, GRIDLIGHT_OT_reset_probes)
