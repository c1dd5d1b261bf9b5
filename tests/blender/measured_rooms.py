# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms for the tables of docs/measurements.md, each a scene with the grid that is baked in it. All surfaces are
diffuse unless told; metres."""

import bpy
import numpy as np
from gridlight.cli import verify, verify_points
from gridlight.cli.verify_measure import Points
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_directions
from gridlight.tests import scenes
from scene_builders import image, material, node

PLACES, SEEDS = 20, (0, 1)  # of each kind, with each seed: single places make figures jump
WHITE, GREY, EARTH = (0.75, 0.75, 0.72), (0.5, 0.5, 0.5), (0.4, 0.35, 0.3)


def places(scene, snapshot, field):
    """Probes, free places and places on surfaces where ``field`` is measured."""
    space = verify_points.FreeSpace(snapshot, verify_points.cycles_light(scene))
    first, second = (verify.choose_points(field, space, PLACES, seed) for seed in SEEDS)
    return [
        Points(
            one.name,
            np.concatenate([one.positions, other.positions]),
            np.concatenate([one.normals, other.normals]),
            None if one.nodes is None else np.concatenate([one.nodes, other.nodes]),
        )
        for one, other in zip(first, second)
    ]


def in_cornell(**options):
    return lambda: (scenes.cornell(**options), Grid.from_bounds((0.15,) * 3, (2.65,) * 3, (5, 5, 5)))


def two_rooms():
    return scenes.lit_and_dark_rooms(0.1), Grid.from_bounds((0.15,) * 3, (4.95, 2.35, 2.35), (9, 5, 5))


def window():
    scene = scenes.new_scene("Window", (0.3, 0.4, 0.6))
    plaster, t = scenes.diffuse((0.6, 0.55, 0.5)), 0.2
    for name, low, high in (
        ("Floor", (-t, -t, -t), (5 + t, 4 + t, 0)),
        ("Ceiling", (-t, -t, 2.8), (5 + t, 4 + t, 2.8 + t)),
        ("Back", (-t, 4, 0), (5 + t, 4 + t, 2.8)),
        ("Left", (-t, 0, 0), (0, 4, 2.8)),
        ("Right", (5, 0, 0), (5 + t, 4, 2.8)),
        ("Front left", (-t, -t, 0), (1.5, 0, 2.8)),
        ("Front right", (3.5, -t, 0), (5 + t, 0, 2.8)),
        ("Sill", (1.5, -t, 0), (3.5, 0, 0.9)),
        ("Lintel", (1.5, -t, 2.2), (3.5, 0, 2.8)),
    ):
        scenes.add_box(scene, name, low, high, plaster)
    scenes.add_box(scene, "Table", (2, 1.5, 0), (3.2, 2.3, 0.75), scenes.diffuse((0.3, 0.2, 0.1)))
    scenes.add_light(scene, "SUN", rotation=(-0.8, 0.2, 0), energy=3.0, angle=0.01)
    return scene, Grid.from_bounds((0.3, 0.3, 0.3), (4.7, 3.7, 2.5), (5, 5, 4))


def veiled_sun():
    """The same room under an environment map whose sun is a glow of Gauss' shape, three degrees deep, and no lamp."""
    scene, grid = window()
    for item in [item for item in scene.objects if item.type == "LIGHT"]:
        bpy.data.objects.remove(item)
    width, height = 256, 128
    away = panorama_directions(width, height) @ (0.21, -0.79, 0.57)
    glow = np.exp(-((np.arccos(np.clip(away, -1, 1)) / np.radians(3.0)) ** 2) / 2)
    pixels = np.ones((height, width, 4))
    pixels[..., :3] = (0.3, 0.4, 0.6) + 180.0 * glow[..., None] * (1.0, 0.9, 0.7)
    tree = scene.world.node_tree
    background = next(item for item in tree.nodes if item.type == "BACKGROUND")
    sky = node(tree, "ShaderNodeTexEnvironment", image=image("Veiled sun", pixels))
    tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    return scene, grid


def outdoors():
    scene = scenes.new_scene("Outdoors", (0.4, 0.5, 0.7))
    scenes.add_box(scene, "Ground", (-20, -20, -1), (20, 20, 0), scenes.diffuse((0.4, 0.35, 0.3)))
    scenes.add_box(scene, "Red", (-2, -1, 0), (-0.5, 1, 2), scenes.diffuse((0.7, 0.2, 0.2)), 0.4)
    scenes.add_box(scene, "Green", (1, -0.5, 0), (2, 1.5, 1), scenes.diffuse((0.2, 0.7, 0.2)), -0.3)
    scenes.add_light(scene, "SUN", rotation=(0.6, 0.5, 0), energy=4.0, angle=0.01)
    return scene, Grid.from_bounds((-3, -2.5, 0.4), (3, 2.5, 3), (5, 5, 4))


def panel():
    scene = scenes.new_scene("Panel")
    colors = ((0.7, 0.7, 0.7), (0.7, 0.7, 0.7), (0.6, 0.3, 0.3), (0.3, 0.6, 0.3), (0.5, 0.5, 0.6), (0.7, 0.6, 0.5))
    walls = [scenes.diffuse(color) for color in colors]
    scenes.add_room_slabs(scene, (0, 0, 0), (4, 3, 2.6), 0.2, walls)
    scenes.add_plane(scene, "Panel", (2, 1.5, 2.59), (0.4, 0, 0), (0, -0.3, 0), scenes.emitter((1, 0.9, 0.8), 12.0))
    scenes.add_box(scene, "Box", (1, 1, 0), (1.8, 1.9, 0.8), walls[0], 0.5)
    return scene, Grid.from_bounds((0.3, 0.3, 0.3), (3.7, 2.7, 2.3), (4, 4, 4))


def spot_in_a_cube():
    """A cube with its normals outwards, as Blender adds it; a spot and a box."""
    scene = scenes.new_scene("Cube")
    scenes.add_box(scene, "Room", (0, 0, 0), (4, 4, 3), scenes.diffuse(WHITE))
    scenes.add_box(scene, "Box", (2.2, 2.4, 0), (3, 3.2, 1.2), scenes.diffuse((0.2, 0.3, 0.7)), 0.4)
    scenes.add_light(scene, "SPOT", (1, 1, 2.8), (0.5, -0.4, 0), energy=300.0, spot_size=1.0, shadow_soft_size=0.05)
    return scene, Grid.from_bounds((0.4, 0.4, 0.4), (3.6, 3.6, 2.6), (5, 5, 4))


def corridor():
    """18 m long, with luminous panels in its ceiling."""
    scene = scenes.new_scene("Corridor")
    walls = [scenes.diffuse(color) for color in (GREY, WHITE, WHITE, WHITE, (0.3, 0.5, 0.6), (0.6, 0.4, 0.3))]
    scenes.add_room_slabs(scene, (0, 0, 0), (18, 2, 2.6), 0.2, walls)
    glow = scenes.emitter((1.0, 0.95, 0.85), 8.0)
    for x in (1.5, 6.5, 11.5, 16.5):
        scenes.add_plane(scene, "Panel", (x, 1, 2.59), (0.6, 0, 0), (0, -0.3, 0), glow)
    return scene, Grid.from_bounds((0.4, 0.3, 0.3), (17.6, 1.7, 2.3), (19, 3, 4))


def open_door():
    """A room that gets its light through a door of 60 cm, from one with a window to the sun."""
    scene = scenes.new_scene("Door", (0.3, 0.4, 0.6))
    plaster, t = scenes.diffuse(WHITE), 0.2
    for name, low, high in (
        ("Floor", (-t, -t, -t), (7 + t, 3 + t, 0)),
        ("Ceiling", (-t, -t, 2.6), (7 + t, 3 + t, 2.6 + t)),
        ("Back", (-t, 3, 0), (7 + t, 3 + t, 2.6)),
        ("Left", (-t, 0, 0), (0, 3, 2.6)),
        ("Right", (7, 0, 0), (7 + t, 3, 2.6)),
        ("Front left", (-t, -t, 0), (0.8, 0, 2.6)),
        ("Front right", (2.8, -t, 0), (7 + t, 0, 2.6)),
        ("Sill", (0.8, -t, 0), (2.8, 0, 0.9)),
        ("Lintel", (0.8, -t, 2.2), (2.8, 0, 2.6)),
        ("Between, near", (3.9, 0, 0), (4.0, 1.2, 2.6)),
        ("Between, far", (3.9, 1.8, 0), (4.0, 3, 2.6)),
        ("Over the door", (3.9, 1.2, 2.0), (4.0, 1.8, 2.6)),
    ):
        scenes.add_box(scene, name, low, high, plaster)
    scenes.add_light(scene, "SUN", rotation=(-0.8, 0.2, 0), energy=4.0, angle=0.01)
    return scene, Grid.from_bounds((0.25, 0.25, 0.25), (6.75, 2.75, 2.35), (12, 6, 5))


def garage():
    """24 glowing strips of 4 cm, 8 cm under the ceiling."""
    scene = scenes.new_scene("Garage")
    walls = [scenes.diffuse(color) for color in (EARTH, WHITE, WHITE, WHITE, GREY, GREY)]
    scenes.add_room_slabs(scene, (0, 0, 0), (16, 10, 3), 0.2, walls)
    glow = scenes.emitter((1.0, 0.97, 0.9), 30.0)
    for x in np.linspace(1.5, 14.5, 6):
        for y in np.linspace(1.5, 8.5, 4):
            scenes.add_box(scene, "Strip", (x - 0.6, y - 0.02, 2.88), (x + 0.6, y + 0.02, 2.92), glow)
    for x in (4, 8, 12):
        scenes.add_box(scene, "Pillar", (x - 0.2, 4.8, 0), (x + 0.2, 5.2, 3), walls[0])
    return scene, Grid.from_bounds((0.5, 0.5, 0.4), (15.5, 9.5, 2.6), (13, 8, 4))


def slats():
    """A room behind twenty slats, under the sun."""
    scene = scenes.new_scene("Slats", (0.2, 0.3, 0.5))
    floor, wall = scenes.diffuse(EARTH), scenes.diffuse(WHITE)
    for name, low, high in (
        ("Floor", (-0.2, -0.2, -0.2), (4.2, 4.2, 0)),
        ("Ceiling", (-0.2, -0.2, 2.6), (4.2, 4.2, 2.8)),
        ("Back", (-0.2, 4, 0), (4.2, 4.2, 2.6)),
        ("Left", (-0.2, 0, 0), (0, 4, 2.6)),
        ("Right", (4, 0, 0), (4.2, 4, 2.6)),
    ):
        scenes.add_box(scene, name, low, high, floor if name == "Floor" else wall)
    for x in np.linspace(0.1, 3.9, 20):
        scenes.add_box(scene, "Slat", (x - 0.05, -0.15, 0), (x + 0.05, -0.05, 2.6), scenes.diffuse((0.4, 0.25, 0.15)))
    scenes.add_light(scene, "SUN", rotation=(-0.9, 0.3, 0), energy=5.0, angle=0.01)
    return scene, Grid.from_bounds((0.3, 0.3, 0.3), (3.7, 3.7, 2.3), (6, 6, 4))


def house():
    """Walls and roof of single planes on open ground; a window and a door in them."""
    scene = scenes.new_scene("House", (0.4, 0.5, 0.7))
    scenes.add_box(scene, "Ground", (-20, -20, -1), (20, 20, 0), scenes.diffuse(EARTH))
    wall = scenes.diffuse(WHITE)
    for name, middle, u, v in (
        ("Back", (2.5, 4, 1.4), (-2.5, 0, 0), (0, 0, 1.4)),
        ("Left", (0, 2, 1.4), (0, -2, 0), (0, 0, 1.4)),
        ("Right", (5, 2, 1.4), (0, 2, 0), (0, 0, 1.4)),
        ("Roof", (2.5, 2, 2.8), (2.5, 0, 0), (0, 2, 0)),
        ("Front, left", (0.5, 0, 1.4), (0.5, 0, 0), (0, 0, 1.4)),
        ("Front, right", (3.9, 0, 1.4), (1.1, 0, 0), (0, 0, 1.4)),
        ("Sill", (1.9, 0, 0.45), (0.9, 0, 0), (0, 0, 0.45)),
        ("Lintel", (1.9, 0, 2.5), (0.9, 0, 0), (0, 0, 0.3)),
    ):
        scenes.add_plane(scene, name, middle, u, v, wall)
    scenes.add_light(scene, "SUN", rotation=(-0.8, 0.2, 0), energy=4.0, angle=0.01)
    return scene, Grid.from_bounds((-1, -1, 0.2), (6, 5, 3.2), (9, 8, 5))


def curtain():
    """A room behind a curtain of Diffuse and Translucent, sun and sky."""
    scene, grid = window()
    color = (0.8, 0.7, 0.5, 1.0)
    cloth = material("Cloth", "ShaderNodeMixShader", {"Fac": 0.5})
    tree = cloth.node_tree
    mix = next(item for item in tree.nodes if item.type == "MIX_SHADER")
    for socket, kind in ((mix.inputs[1], "ShaderNodeBsdfDiffuse"), (mix.inputs[2], "ShaderNodeBsdfTranslucent")):
        tree.links.new(node(tree, kind, {"Color": color}).outputs[0], socket)
    scenes.add_plane(scene, "Curtain", (2.5, 0.1, 1.55), (1.1, 0, 0), (0, 0, 0.7), cloth)
    return scene, grid


# Rooms that no setting was tuned to.
ROOMS = {
    "Cornell room, area light": in_cornell(),
    "glowing panel 1 cm under the ceiling": panel,
    "window, sun and sky": window,
    "window, veiled sun of an environment map": veiled_sun,
    "open ground, two boxes, sun and sky": outdoors,
    "cube with its normals outwards, spot": spot_in_a_cube,
    "corridor of 18 m, luminous panels": corridor,
    "room lit through a door of 60 cm": open_door,
    "garage, 24 strips of 4 cm": garage,
    "room behind twenty slats, sun": slats,
    "house of single planes, sun and sky": house,
    "curtain of Diffuse and Translucent, sun": curtain,
}
