# SPDX-License-Identifier: GPL-3.0-or-later
"""Show where a bake will sample the light: probes as Empties, without those that light nothing."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.conventions import ACTIVE, CULLED
from ..core.culling import needed_nodes
from ..core.errors import GridlightError, InputError
from ..core.grid import Grid
from ..core.snapshot import Volume
from ..scene import probe_objects
from ..scene.read import read_scene
from ..scene.volumes import find_volumes


class GRIDLIGHT_OT_place_probes(bpy.types.Operator):
    """Place an Empty at every probe that lights some surface: of the active volume, or of all volumes"""

    bl_idname = "gridlight.place_probes"
    bl_label = "Place Probes"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        scene = context.scene
        try:
            chosen = _chosen_volumes(scene, context.view_layer.objects.active)
            snapshot = read_scene(scene, context.view_layer)
            if not len(snapshot.triangles):
                raise InputError(f"scene '{scene.name}' has no surface to light; add a mesh first")
            states = [_place(scene, volume, snapshot.triangle_positions) for volume in chosen]
        except GridlightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        # Volumes that were deleted or renamed since must not leave their probes behind.
        for gone in probe_objects.placed_volumes(scene) - {volume.name for volume in find_volumes(scene)}:
            probe_objects.clear_probes(scene, gone)
        state = np.concatenate(states)
        active = int((state == ACTIVE).sum())
        self.report(
            {"INFO"}, f"{active} of {len(state)} probes placed; {len(state) - active} light nothing and are culled"
        )
        return {"FINISHED"}


class GRIDLIGHT_OT_clear_probes(bpy.types.Operator):
    """Remove all probe Empties from the scene; volumes and baked light stay"""

    bl_idname = "gridlight.clear_probes"
    bl_label = "Clear Probes"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        count = probe_objects.clear_probes(context.scene)
        self.report({"INFO"}, f"{count} probes removed")
        return {"FINISHED"}


def _chosen_volumes(scene: bpy.types.Scene, active: bpy.types.Object | None) -> list[Volume]:
    """The active object's volume, otherwise all of the scene.

    Raises:
        InputError: there is none.
    """
    volumes = find_volumes(scene)
    if not volumes:
        raise InputError("the scene has no probe volume; add one with Add › Light Probe › Gridlight Volume")
    return [volume for volume in volumes if active is not None and volume.name == active.name] or volumes


def _place(scene: bpy.types.Scene, volume: Volume, triangles: np.ndarray) -> np.ndarray:
    """Culls and places one volume; returns its states (P,)."""
    grid = Grid(volume.matrix, volume.resolution, volume.name)
    state = np.where(needed_nodes(grid, triangles), ACTIVE, CULLED).astype(np.uint8)
    probe_objects.place_probes(scene, grid, state, scene.objects[volume.name])
    return state


classes = (GRIDLIGHT_OT_place_probes, GRIDLIGHT_OT_clear_probes)
