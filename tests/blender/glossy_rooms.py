# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms with mirrors, metal and gloss for measurements against Cycles."""

import bpy
import numpy as np
from gridlight.tests import scenes
from scene_builders import material, mesh, place

SIDES = ("floor", "ceiling", "back", "left", "right", "front")
PLAIN_M = (3.0, 3.0, 2.6)


def principled(name, **inputs):
    """A Principled BSDF; ``inputs`` by socket name with _ for spaces."""
    values = {
        key.replace("_", " "): (*value, 1.0) if isinstance(value, tuple) else value for key, value in inputs.items()
    }
    return material(name, "ShaderNodeBsdfPrincipled", values)


def white():
    return scenes.diffuse((0.75, 0.75, 0.72), "White")


def metal(roughness, color=(0.9, 0.8, 0.6)):
    return principled("Metal", Base_Color=color, Metallic=1.0, Roughness=roughness)


def shell(scene, size, window=None, **materials):
    """A closed room from the origin to ``size`` with walls of 0.2 m; ``window`` (x0, x1, z0, z1) is open in its front.
    Sides without a material are white."""
    x, y, z = size
    w, plain = 0.2, white()
    of = {side: materials.get(side, plain) for side in SIDES}
    scenes.add_box(scene, "Floor", (-w, -w, -w), (x + w, y + w, 0), of["floor"])
    scenes.add_box(scene, "Ceiling", (-w, -w, z), (x + w, y + w, z + w), of["ceiling"])
    scenes.add_box(scene, "Back", (-w, y, 0), (x + w, y + w, z), of["back"])
    scenes.add_box(scene, "Left", (-w, 0, 0), (0, y, z), of["left"])
    scenes.add_box(scene, "Right", (x, 0, 0), (x + w, y, z), of["right"])
    if window is None:
        scenes.add_box(scene, "Front", (-w, -w, 0), (x + w, 0, z), of["front"])
        return
    x0, x1, z0, z1 = window
    for low, high in (((-w, 0), (x0, z)), ((x1, 0), (x + w, z)), ((x0, 0), (x1, z0)), ((x0, z1), (x1, z))):
        scenes.add_box(scene, "Front", (low[0], -w, low[1]), (high[0], 0, high[1]), of["front"])


def panel(scene, edge_m=0.6, energy=60.0, where=(1.5, 1.5, 2.5)):
    scenes.add_light(scene, "AREA", where, energy=energy, shape="SQUARE", size=edge_m)


def ball(scene, centre, radius, its_material, rings=24):
    """A smooth ball."""
    polar, around = np.linspace(0.0, np.pi, rings + 1)[1:-1], np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    p, a = np.meshgrid(polar, around, indexing="ij")
    points = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1).reshape(-1, 3)
    points = np.concatenate([points, [[0, 0, 1], [0, 0, -1]]])
    n, last = 2 * rings, (rings - 2) * 2 * rings
    faces = [
        (r * n + i, (r + 1) * n + i, (r + 1) * n + (i + 1) % n, r * n + (i + 1) % n)
        for r in range(rings - 2)
        for i in range(n)
    ]
    faces += [(len(points) - 2, i, (i + 1) % n) for i in range(n)]
    faces += [(len(points) - 1, last + (i + 1) % n, last + i) for i in range(n)]
    data = mesh("Ball", (points * radius + centre).tolist(), faces)
    data.polygons.foreach_set("use_smooth", [True] * len(faces))
    data.materials.append(its_material)
    place(data, "Ball", scene.collection)


def metal_walls(scene, roughness):
    shiny = metal(roughness)
    shell(scene, PLAIN_M, floor=shiny, left=shiny)
    scenes.add_box(scene, "Box", (1.6, 1.7, 0), (2.3, 2.4, 1.1), shiny)
    panel(scene)


def all_of_metal(scene, roughness):
    shell(scene, PLAIN_M, **{side: metal(roughness) for side in SIDES if side != "ceiling"})
    panel(scene)


def bathroom(scene):
    tiles = principled("Tiles", Base_Color=(0.75, 0.78, 0.8), Roughness=0.1)
    floor = principled("Floor", Base_Color=(0.25, 0.22, 0.2), Roughness=0.15)
    tub = principled("Tub", Base_Color=(0.85, 0.85, 0.85), Roughness=0.3, Coat_Weight=1.0, Coat_Roughness=0.05)
    shell(scene, (3.0, 2.4, 2.5), floor=floor, **{side: tiles for side in ("back", "left", "right", "front")})
    scenes.add_box(scene, "Mirror", (0.8, 2.37, 0.9), (2.2, 2.39, 2.0), metal(0.0, (0.9, 0.9, 0.9)))
    scenes.add_box(scene, "Tub", (0.05, 0.05, 0), (0.8, 1.8, 0.55), tub)
    panel(scene, 0.4, 30.0, (1.5, 1.2, 2.45))
    scenes.add_light(scene, "POINT", (1.5, 2.25, 2.15), energy=15.0, shadow_soft_size=0.05)


def polished_floor(scene):
    shell(
        scene, (4.0, 4.0, 2.6), (1, 3, 0.9, 2.2), floor=principled("Dark", Base_Color=(0.05, 0.05, 0.06), Roughness=0.1)
    )
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.6, 0.8, 1.0, 1.0)
    sun = scenes.add_light(scene, "SUN", (0, 0, 5), energy=8.0, angle=0.0092)
    sun.rotation_euler = (np.radians(50), 0, np.radians(8))


def chrome_ball(scene):
    shell(scene, PLAIN_M, left=scenes.diffuse((0.6, 0.1, 0.1), "Red"))
    ball(scene, (1.6, 1.7, 0.7), 0.6, metal(0.03, (0.95, 0.95, 0.95)))
    scenes.add_light(scene, "POINT", (0.7, 0.8, 2.2), energy=60.0, shadow_soft_size=0.1)


def coated_wood(scene):
    wood = principled("Wood", Base_Color=(0.3, 0.17, 0.08), Roughness=0.5, Coat_Weight=1.0, Coat_Roughness=0.05)
    shell(scene, PLAIN_M, floor=wood, left=wood)
    scenes.add_box(scene, "Table", (0.8, 0.9, 0.65), (2.3, 1.9, 0.72), wood)
    panel(scene, 0.5)


def plastic(scene, roughness, grey):
    shiny = principled("Plastic", Base_Color=(grey, grey, grey), Roughness=roughness)
    shell(scene, PLAIN_M, floor=shiny, left=shiny)
    scenes.add_box(scene, "Box", (1.6, 1.7, 0), (2.3, 2.4, 1.1), shiny)
    panel(scene)


def all_of_plastic(scene, grey):
    """Everything of a Principled BSDF as Blender adds it, but for its colour."""
    plain = principled("Plastic", Base_Color=(grey, grey, grey), Roughness=0.5)
    shell(scene, PLAIN_M, **dict.fromkeys(SIDES, plain))
    scenes.add_box(scene, "Box", (1.6, 1.7, 0), (2.3, 2.4, 1.1), plain)
    panel(scene)


def plastic_in_the_sun(scene, grey):
    """The same with a window, and a patch of sun on the floor and the box."""
    plain = principled("Plastic", Base_Color=(grey, grey, grey), Roughness=0.5)
    shell(scene, PLAIN_M, (1.0, 2.0, 0.9, 2.2), **dict.fromkeys(SIDES, plain))
    scenes.add_box(scene, "Box", (1.6, 1.7, 0), (2.3, 2.4, 1.1), plain)
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.6, 0.8, 1.0, 1.0)
    sun = scenes.add_light(scene, "SUN", (0, 0, 5), energy=8.0, angle=0.0092)
    sun.rotation_euler = (np.radians(50), 0, np.radians(8))


def coloured_plastic(scene):
    def plain(name, color):
        return principled(name, Base_Color=color, Roughness=0.5)

    sides = {
        "floor": plain("Floor", (0.25, 0.15, 0.08)),
        "left": plain("Red", (0.6, 0.05, 0.05)),
        "right": plain("Green", (0.05, 0.4, 0.1)),
        "back": plain("White", (0.7, 0.7, 0.7)),
    }
    shell(scene, PLAIN_M, **sides)
    blue = principled("Blue", Base_Color=(0.05, 0.1, 0.4), Roughness=0.4)
    scenes.add_box(scene, "Box", (1.6, 1.7, 0), (2.3, 2.4, 1.1), blue)
    scenes.add_light(scene, "POINT", (0.9, 1.0, 2.0), energy=80.0, shadow_soft_size=0.1)


def sunny_floor(scene, roughness):
    """Nothing but a floor of brown plastic in a low sun, which is seen in it by all probes."""
    brown = principled("Brown", Base_Color=(0.5, 0.33, 0.19), Roughness=roughness)
    scenes.add_box(scene, "Floor", (-20, -20, -0.2), (20, 20, 0), brown)
    sun = scenes.add_light(scene, "SUN", (0, 0, 5), energy=4.0, angle=0.0092)
    sun.rotation_euler = (np.radians(58), 0, np.radians(8))


def lamp_along_a_wall(scene, roughness):
    """Red plastic that a lamp and all probes see at grazing angles."""
    red = principled("Red", Base_Color=(0.6, 0.05, 0.03), Roughness=roughness)
    scenes.add_box(scene, "Wall", (3, -1, 0), (3.2, 6, 3), red)
    scenes.add_light(scene, "POINT", (2.5, 5.0, 2.4), energy=150.0, shadow_soft_size=0.1)


ROOMS = {
    "bathroom": (bathroom,),
    "metal 0.1": (metal_walls, 0.1),
    "metal 0.3": (metal_walls, 0.3),
    "metal 0.6": (metal_walls, 0.6),
    "all of metal 0.3": (all_of_metal, 0.3),
    "polished floor": (polished_floor,),
    "chrome ball": (chrome_ball,),
    "coated wood": (coated_wood,),
    "plastic 0.3, dark": (plastic, 0.3, 0.03),
    "plastic 0.5, dark": (plastic, 0.5, 0.03),
    "plastic 0.5, white": (plastic, 0.5, 0.8),
    "all of white plastic": (all_of_plastic, 0.8),
    "all of grey plastic": (all_of_plastic, 0.3),
    "grey plastic in the sun": (plastic_in_the_sun, 0.2),
    "coloured plastic": (coloured_plastic,),
    "plastic floor in the sun, 0.35": (sunny_floor, 0.35),
    "plastic floor in the sun, 0.5": (sunny_floor, 0.5),
    "lamp along a plastic wall, 0.3": (lamp_along_a_wall, 0.3),
    "lamp along a plastic wall, 0.5": (lamp_along_a_wall, 0.5),
}


def build(name) -> tuple[bpy.types.Scene, np.ndarray]:
    """The room ``name`` and its inner size (3,), metres."""
    scene = scenes.new_scene(name)
    maker, *values = ROOMS[name]
    maker(scene, *values)
    scene.view_layers[0].update()
    sizes = {bathroom: (3.0, 2.4, 2.5), polished_floor: (4.0, 4.0, 2.6)}
    return scene, np.array(sizes.get(maker, PLAIN_M))
