# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo gallery: a small museum that shows what bounced light does.

The building is in ``gallery_plan``, what stands in it in ``gallery_furnishing``; this file puts them into a scene, with
lights, a camera and the probe volume. Light groups (custom property ``gridlight_group``): "ceiling1" over the hall,
"ceiling2" in the crimson room, "wall" for everything that glows, "dynamic" for the lamp that wanders from room to room.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..core.grid import Grid
from . import gallery_furnishing as furnishing
from . import gallery_plan as plan
from .gallery_materials import gallery_materials
from .gallery_shapes import Solid
from .volumes import create_volume

FIRST_FRAME, LAST_FRAME = 1, 250

# Frame: position of the wandering lamp; it returns to where it started.
LAMP_PATH = {
    1: (-7.6, 1.3, 2.1),
    32: (-4.85, 0.3, 2.0),
    63: (-0.4, 2.1, 2.3),
    94: (4.85, -0.3, 2.0),
    125: (7.8, -1.4, 2.1),
    157: (4.85, 0.3, 2.0),
    188: (0.0, -1.8, 2.3),
    219: (-4.85, -0.3, 2.0),
    250: (-7.6, 1.3, 2.1),
}

EAST, WEST, NORTH, SOUTH = -np.pi / 2, np.pi / 2, 0.0, np.pi  # turn of what hangs on that wall of a room


def build_gallery(scene: bpy.types.Scene | None = None) -> bpy.types.Scene:
    """Builds the gallery in ``scene``, or in a new scene "Gridlight Gallery", and returns that scene.

    The scene's own objects stay; its camera, world, frame range and view transform become the gallery's.
    """
    if scene is None:
        scene = bpy.data.scenes.new("Gridlight Gallery")
    builder = _Builder(scene)
    builder.building()
    builder.collection_pieces()
    builder.lamps()
    builder.lights()
    _camera(scene, builder.collection)
    _volume(scene)
    _scene_settings(scene)
    scene.view_layers[0].update()
    return scene


class _Builder:
    """Places solids into one collection; equal pieces share one mesh."""

    def __init__(self, scene: bpy.types.Scene):
        self.materials = gallery_materials()
        self.collection = bpy.data.collections.new("Gridlight Gallery")
        scene.collection.children.link(self.collection)
        self.meshes: dict[str, bpy.types.Mesh] = {}

    def put(self, name: str, make, at=(0, 0, 0), turn: float = 0.0, group: str = "") -> bpy.types.Object:
        """A new object of the mesh that ``make()`` gives the first time that ``name`` is asked for."""
        if name not in self.meshes:
            made = make()
            self.meshes[name] = made.to_mesh(name, self.materials) if isinstance(made, Solid) else made
        thing = bpy.data.objects.new(name, self.meshes[name])
        thing.matrix_world = Matrix.Translation(Vector(at)) @ Matrix.Rotation(turn, 4, "Z")
        if group:
            thing["gridlight_group"] = group
        self.collection.objects.link(thing)
        return thing

    def building(self) -> None:
        self.put("Building", plan.shell)
        self.put("Arches", plan.arches)
        self.put("Vault", plan.vault)
        self.put("Cornice", plan.cornice)
        self.put("Trim", plan.trim)
        self.put("Balustrades", plan.railings)
        self.put("Spiral stair", plan.stair)
        for x in (-3.5, -1.75, 0.0, 1.75, 3.5):
            for side, turn in ((1, NORTH), (-1, SOUTH)):
                self.put("Wall panel", lambda: furnishing.wall_panel(1.35, 1.9), (x, side * plan.HALL_Y, 4.4), turn)

    def hang(self, painting: str, width: float, height: float, at, turn: float) -> None:
        self.put(painting, lambda: furnishing.picture_mesh(painting, width, height, self.materials), at, turn)
        self.put(f"Frame {painting}", lambda: furnishing.frame(width, height), at, turn)

    def stand(self, piece: str, make, at, plinth: tuple[float, float], turn: float = 0.0) -> None:
        """``piece`` on a plinth of (size, height)."""
        size, height = plinth
        self.put(f"Plinth {size:g} × {height:g}", lambda: furnishing.plinth(size, height), at)
        self.put(piece, make, (at[0], at[1], at[2] + height), turn)

    def collection_pieces(self) -> None:
        hall, wing, upper = plan.HALL_Y, plan.WING_Y, plan.LOGGIA_FLOOR
        self.hang("Ridges at Dusk", 3.0, 1.75, (-1.9, -hall, 1.85), SOUTH)
        self.hang("Ridges at Dusk", 3.0, 1.75, (-8.1, wing, 1.75), NORTH)
        self.hang("Rings", 1.7, 1.7, (plan.WING_X1, 0.0, 1.72), EAST)
        self.hang("Rings", 1.7, 1.7, (2.35, -hall, 1.85), SOUTH)
        self.hang("Tide", 1.26, 1.8, (0.0, hall, 1.85), NORTH)
        self.hang("Tide", 1.26, 1.8, (8.1, -wing, 1.7), SOUTH)
        self.hang("Tide", 1.26, 1.8, (-plan.WING_X1, 0.0, upper + 1.7), WEST)
        self.hang("Rings", 1.7, 1.7, (-8.1, wing, upper + 1.75), NORTH)
        self.stand("Ultramarine knot", furnishing.knot, (-2.2, 0.0, 0), (0.7, 1.0), 0.5)
        self.stand("Turning column", furnishing.twisted_column, (2.9, 1.9, 0), (0.62, 0.55))
        self.stand("Marble amphora", lambda: furnishing.amphora("Marble"), (-5.75, -2.2, 0), (0.5, 0.9))
        self.stand("Celadon amphora", lambda: furnishing.amphora("Celadon"), (-5.75, 2.2, 0), (0.5, 0.9))
        self.stand("Spheres", furnishing.spheres, (6.2, -1.95, 0), (0.85, 0.8), 0.3)
        self.stand("Turning column", furnishing.twisted_column, (-8.0, 0.0, upper), (0.62, 0.55))
        self.stand("Amphora", furnishing.amphora, (7.0, -1.8, upper), (0.5, 0.9))
        self.put("Bench", furnishing.bench, (0.9, 0.0, 0), np.pi / 2)
        self.put("Bench", furnishing.bench, (-8.1, 1.75, 0))
        self.put("Bench", furnishing.bench, (8.1, -1.35, 0))

    def lamps(self) -> None:
        """Wall lamps, light panels and coves: they glow, so their light is in the probes without being a light
        object."""
        hall, wing, upper = plan.HALL_Y, plan.WING_Y, plan.LOGGIA_FLOOR
        places = [
            ((-1.4, hall, 2.2), NORTH),
            ((1.4, hall, 2.2), NORTH),
            ((0.75, -hall, 2.2), SOUTH),
            ((3.85, -hall, 2.2), SOUTH),
        ]
        for side in (-1, 1):
            for level in (0, upper):
                places += [((side * 5.75, wing, level + 2.1), NORTH), ((side * 5.75, -wing, level + 2.1), SOUTH)]
        places += [((plan.WING_X1, side * 1.65, 2.1), EAST) for side in (-1, 1)]
        for at, turn in places:
            self.put("Wall lamp", furnishing.wall_lamp, at, turn, group="wall")
        panels = [(6.55, 1, 0), (8.05, 1, 0), (6.75, -1, 0), (9.5, -1, 0)]
        panels += [(side * x, wall, upper) for side in (-1, 1) for x in (6.6, 9.6) for wall in (-1, 1)]
        for x, wall, floor in panels:
            self.put(
                "Light panel",
                furnishing.light_panel,
                (x, wall * wing, floor + 1.75),
                NORTH if wall > 0 else SOUTH,
                group="wall",
            )
        self.put("Cove lights", plan.cove_lights, group="wall")

    def lights(self) -> None:
        self.put("Lay light frame", lambda: furnishing.lay_light(6.2, 1.7, 1.0), (0, 0, 7.6))
        self._area("Hall ceiling light", "ceiling1", (0, 0, 7.59), (6.0, 1.5), 300.0, (1.0, 0.95, 0.88))
        self.put("Room light frame", lambda: furnishing.lay_light(1.9, 1.1), (-8.1, 0, 3.27))
        self._area("Room ceiling light", "ceiling2", (-8.1, 0, 3.265), (1.7, 0.9), 52.0, (1.0, 0.90, 0.78))
        lamp = bpy.data.lights.new("Wandering lamp", "POINT")
        lamp.energy, lamp.color, lamp.shadow_soft_size = 60.0, (1.0, 0.72, 0.42), 0.09
        thing = bpy.data.objects.new("Wandering lamp", lamp)
        thing["gridlight_group"], thing["gridlight_role"] = "dynamic", "dynamic"
        for frame, place in LAMP_PATH.items():
            thing.location = place
            thing.keyframe_insert("location", frame=frame)
        thing.location = LAMP_PATH[FIRST_FRAME]
        self.collection.objects.link(thing)

    def _area(self, name: str, group: str, at, size, power: float, colour) -> None:
        light = bpy.data.lights.new(name, "AREA")
        light.shape, (light.size, light.size_y) = "RECTANGLE", size
        light.energy, light.color = power, colour
        thing = bpy.data.objects.new(name, light)
        thing.location = at
        thing["gridlight_group"] = group
        self.collection.objects.link(thing)


def _camera(scene: bpy.types.Scene, collection: bpy.types.Collection) -> None:
    data = bpy.data.cameras.new("Gallery Camera")
    data.lens, data.clip_start, data.clip_end = 20.0, 0.05, 100.0
    camera = bpy.data.objects.new("Gallery Camera", data)
    place, target = Vector((-10.6, -1.3, 1.6)), Vector((0.0, 0.5, 1.95))
    camera.location = place
    camera.rotation_euler = (target - place).to_track_quat("-Z", "Y").to_euler()
    collection.objects.link(camera)
    scene.camera = camera


def _volume(scene: bpy.types.Scene) -> None:
    low, high = np.array(plan.VOLUME_LOW), np.array(plan.VOLUME_HIGH)
    box = Grid.from_bounds(low, high, plan.VOLUME_RESOLUTION).matrix
    create_volume(scene, "Gallery Volume", box, plan.VOLUME_RESOLUTION)


def _scene_settings(scene: bpy.types.Scene) -> None:
    world = bpy.data.worlds.new("Gallery World")
    world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    scene.world = world
    scene.frame_start, scene.frame_end = FIRST_FRAME, LAST_FRAME
    scene.frame_set(FIRST_FRAME)
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = 1280, 720
    scene.view_settings.view_transform = "Standard"
    scene.view_settings.look = "None"
    scene.view_settings.exposure, scene.view_settings.gamma = 0.0, 1.0
