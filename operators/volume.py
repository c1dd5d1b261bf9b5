# SPDX-License-Identifier: GPL-3.0-or-later
"""Make, fit and find probe volumes."""

from __future__ import annotations

import bpy
import numpy as np
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty
from mathutils import Matrix

from ..core.errors import GridlightError, InputError
from ..core.grid import Grid
from ..core.snapshot import SceneSnapshot
from ..scene.read import read_scene
from ..scene.volume_fit import fit_volume
from ..scene.volumes import box_of, create_volume, is_volume, resolution_for, resolution_of
from . import names
from .libraries import library_of
from .volume_choice import active_volume, can_read_scene, in_object_mode, volumes_of

_FIT_ITEMS = [
    ("SCENE", "Scene", "Around what matters in the scene: ground planes, sky domes and far stragglers are left out"),
    ("SELECTION", "Selection", "Around the selected objects"),
]


class GRIDLIGHT_OT_add_volume(bpy.types.Operator):
    """Add a volume of light probes around the scene or the selected objects"""

    bl_idname = names.ADD_VOLUME
    bl_label = "Gridlight Volume"
    bl_options = {"REGISTER", "UNDO"}

    fit: EnumProperty(name="Fit to", description="What the volume goes around", items=_FIT_ITEMS)
    by_spacing: BoolProperty(
        name="Choose Spacing",
        description="Give the distance between probes; otherwise there will be one to three thousand of them",
    )
    spacing: FloatProperty(
        name="Spacing", description="Distance between probes", default=1.0, min=1e-3, soft_max=10.0, unit="LENGTH"
    )

    @classmethod
    def poll(cls, context):
        return can_read_scene(cls, context)

    def draw(self, _context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "fit")
        layout.prop(self, "by_spacing")
        row = layout.row()
        row.active = self.by_spacing
        row.prop(self, "spacing")

    def execute(self, context):
        try:
            snapshot = _snapshot(context, self.fit)
            grid = fit_volume(snapshot, self.spacing if self.by_spacing else None)
        except GridlightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        item = create_volume(context.scene, "Gridlight Volume", grid.matrix, grid.resolution)
        for other in context.selected_objects:
            other.select_set(False)
        item.select_set(True)
        context.view_layer.objects.active = item
        counts = " × ".join(map(str, grid.resolution))
        self.report({"INFO"}, f"{counts} probes, {grid.cell_size().max():.3g} m apart")
        return {"FINISHED"}


class GRIDLIGHT_OT_fit_volume(bpy.types.Operator):
    """Move and resize the active volume to fit; its rotation and the distance between its probes stay as they are"""

    bl_idname = names.FIT_VOLUME
    bl_label = "Fit Volume"
    bl_options = {"REGISTER", "UNDO"}

    fit: EnumProperty(name="Fit to", description="What the volume goes around", items=_FIT_ITEMS)

    @classmethod
    def poll(cls, context):
        if not can_read_scene(cls, context):
            return False
        volume = active_volume(context)
        if volume is None:
            cls.poll_message_set("Select a probe volume first")
        elif library_of(volume):
            cls.poll_message_set(f"'{volume.name}' comes from {library_of(volume)}; change it in that file")
        else:
            return True
        return False

    def execute(self, context):
        volume = active_volume(context)
        try:
            matrix = _fitted_box(_snapshot(context, self.fit, apart_from=volume), volume)
        except GridlightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        spacing = float((2 * np.linalg.norm(box_of(volume)[:3, :3], axis=0) / _cells(volume)).mean())
        matrix[:3, :3] /= volume.empty_display_size
        volume.matrix_world = Matrix(matrix.tolist())
        context.view_layer.update()
        volume.gridlight_grid.resolution = resolution_for(box_of(volume), spacing)
        return {"FINISHED"}


class GRIDLIGHT_OT_select_volume(bpy.types.Operator):
    """Make this volume the active object"""

    bl_idname = names.SELECT_VOLUME
    bl_label = "Select Volume"
    bl_options = {"REGISTER", "UNDO", "INTERNAL"}

    volume: StringProperty()

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def execute(self, context):
        volume = context.view_layer.objects.get(self.volume)
        if not is_volume(volume):
            self.report({"ERROR"}, f"'{self.volume}' has left this view layer; choose another volume")
            return {"CANCELLED"}
        for other in context.selected_objects:
            other.select_set(False)
        volume.select_set(True)
        context.view_layer.objects.active = volume
        return {"FINISHED"}


def _snapshot(context, fit: str, apart_from: bpy.types.Object | None = None) -> SceneSnapshot:
    """The scene, or the part of it that is selected.

    Raises:
        InputError: there is no surface to fit to.
    """
    snapshot = read_scene(context.scene, context.view_layer, live=True)
    if fit == "SCENE":
        if not len(snapshot.triangles):
            raise InputError("nothing in the scene has a surface that renders show; add a mesh first")
        return snapshot
    chosen = {item.name for item in context.selected_objects if item not in {apart_from, *volumes_of(context.scene)}}
    # Instances are called "owner > instance".
    wanted = [index for index, name in enumerate(snapshot.object_names) if name.split(" > ")[0] in chosen]
    kept = np.isin(snapshot.object_index, wanted)
    if not kept.any():
        raise InputError("nothing with a surface is selected; select what the volume should go around")
    per_triangle = ("triangles", "corner_normals", "corner_uvs", "material_index", "object_index")
    return SceneSnapshot(
        **{**vars(snapshot), **{name: getattr(snapshot, name)[kept] for name in per_triangle}},
    )


def _cells(volume: bpy.types.Object) -> np.ndarray:
    return np.maximum(np.array(resolution_of(volume)) - 1, 1)


def _fitted_box(snapshot: SceneSnapshot, volume: bpy.types.Object) -> np.ndarray:
    """(4, 4) box around ``snapshot`` along the volume's own axes."""
    axes = box_of(volume)[:3, :3]
    axes = axes / np.linalg.norm(axes, axis=0)
    turned = SceneSnapshot(**{**vars(snapshot), "vertices": snapshot.vertices @ np.linalg.inv(axes).T})
    box: Grid = fit_volume(turned)
    matrix = np.eye(4)
    matrix[:3, :3] = axes @ box.matrix[:3, :3]
    matrix[:3, 3] = axes @ box.matrix[:3, 3]
    return matrix


classes = (GRIDLIGHT_OT_add_volume, GRIDLIGHT_OT_fit_volume, GRIDLIGHT_OT_select_volume)
