# SPDX-License-Identifier: GPL-3.0-or-later
"""What keys of Explore mode do to a scene: light groups, wall colour, animation, screenshots."""

from __future__ import annotations

import tempfile
from collections import Counter
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

WALL_MARK = "gridlight_walls"  # custom property of materials that are meant when there is talk of walls
# Reflectance of paints, linear: white, warm grey, ochre, brick, crimson, plum, navy, teal, moss.
WALL_COLORS = (
    (0.80, 0.79, 0.76),
    (0.45, 0.41, 0.37),
    (0.63, 0.42, 0.14),
    (0.48, 0.16, 0.09),
    (0.45, 0.03, 0.04),
    (0.20, 0.06, 0.18),
    (0.05, 0.09, 0.27),
    (0.05, 0.28, 0.27),
    (0.15, 0.25, 0.08),
)
_LOOKS = 24  # directions around the eye in which walls are looked for
_STEP = 2.0**0.5  # intensity per key press
_LEAST = 1 / 64  # darker than this is off


def change_intensity(scene: bpy.types.Scene, group: str, brighter: bool) -> float | None:
    """Turns all lights of ``group`` (an item of the property) up or down; the new factor of the first, None where the
    group is empty."""
    members = [item for item in scene.objects if item.gridlight_light.group == group]
    for item in members:
        value = item.gridlight_light.intensity
        if brighter:
            value = max(value * _STEP, _LEAST)
        else:
            value = 0.0 if value <= _LEAST else value / _STEP
        item.gridlight_light.intensity = round(value, 4)
    return members[0].gridlight_light.intensity if members else None


def wall_materials(context: bpy.types.Context, eye: Vector) -> list[bpy.types.Material]:
    """Materials marked as walls; where none is, the one that most of the walls around ``eye`` wear.

    Materials whose colour comes from a texture cannot be painted and do not count.
    """
    used = {slot.material for item in context.scene.objects for slot in item.material_slots if slot.material}
    marked = [material for material in used if material.get(WALL_MARK) and _color_socket(material) is not None]
    if marked:
        return marked
    depsgraph = context.evaluated_depsgraph_get()
    seen: Counter = Counter()
    for angle in np.arange(_LOOKS) * (2 * np.pi / _LOOKS):
        for rise in (-0.1, 0.1, 0.3):
            direction = Vector((np.cos(angle), np.sin(angle), rise)).normalized()
            hit, _, normal, face, item, _ = context.scene.ray_cast(depsgraph, eye, direction)
            material = _material_of(item.evaluated_get(depsgraph), face) if hit and abs(normal.z) < 0.3 else None
            if material is not None and _color_socket(material) is not None:
                seen[material] += 1
    return [seen.most_common(1)[0][0]] if seen else []


def _material_of(item: bpy.types.Object, face: int) -> bpy.types.Material | None:
    """Material of a face of an evaluated object, as it is in the file."""
    if item.type != "MESH" or not item.material_slots:
        return None
    slot = min(item.data.polygons[face].material_index, len(item.material_slots) - 1)
    material = item.material_slots[slot].material
    return material.original if material else None


def paint(materials: list[bpy.types.Material], index: int) -> None:
    """Gives ``materials`` the wall colour of that number, counted around."""
    for material in materials:
        _color_socket(material).default_value = (*WALL_COLORS[index % len(WALL_COLORS)], 1.0)


def _color_socket(material: bpy.types.Material) -> bpy.types.NodeSocket | None:
    """The base colour that shows and can be set; None where a texture feeds it."""
    if material.node_tree is None or material.library:
        return None
    for node in material.node_tree.nodes:
        name = {"BSDF_PRINCIPLED": "Base Color", "BSDF_DIFFUSE": "Color"}.get(node.type)
        if name and any(output.is_linked for output in node.outputs):
            return None if node.inputs[name].is_linked else node.inputs[name]
    return None


class Animation:
    """Plays the timeline; objects whose light shall not be animated stand still meanwhile."""

    def __init__(self, scene: bpy.types.Scene):
        self._scene = scene
        self._frame = scene.frame_current
        self._held: list[tuple[bpy.types.Object, bpy.types.Action, object]] = []

    def toggle(self) -> bool:
        """Starts or stops; whether it plays now. Needs a window's context."""
        playing = bpy.context.screen.is_animation_playing
        if not playing:
            self._hold()
        bpy.ops.screen.animation_play()
        if playing:
            self._release()
        return not playing

    def stop(self) -> None:
        """Ends what ``toggle`` began and goes back to where it began."""
        if bpy.context.screen is not None and bpy.context.screen.is_animation_playing:
            bpy.ops.screen.animation_cancel(restore_frame=False)
        self._release()
        if self._scene.frame_current != self._frame:
            self._scene.frame_set(self._frame)

    def _hold(self) -> None:
        self._release()
        for item in self._scene.objects:
            animation = item.animation_data
            if animation and animation.action and not item.gridlight_light.animate:
                self._held.append((item, animation.action, getattr(animation, "action_slot", None)))
                animation.action = None

    def _release(self) -> None:
        for item, action, slot in self._held:
            item.animation_data.action = action
            if slot is not None:
                item.animation_data.action_slot = slot
        self._held.clear()


def screenshot_path() -> Path:
    """A new file beside the .blend, or among temporary files where it was never saved."""
    saved = bpy.data.filepath
    folder = Path(saved).parent if saved else Path(tempfile.gettempdir())
    stem = Path(saved).stem if saved else "gridlight"
    number = 1
    while (path := folder / f"{stem}_{number:04d}.png").exists():
        number += 1
    return path
