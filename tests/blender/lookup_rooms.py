# SPDX-License-Identifier: GPL-3.0-or-later
"""Places where a lookup goes wrong: doorways, thin walls, walls that the volume's box reaches into, volumes that stand
askew. Each is a scene with the grid that is baked in it; all surfaces are diffuse, metres."""

import numpy as np
from gridlight.core.grid import Grid
from gridlight.scene.read import read_scene
from gridlight.scene.volume_fit import fit_volume
from gridlight.tests import scenes

WHITE, WOOD = (0.75, 0.75, 0.72), (0.45, 0.3, 0.2)


def walled(scene, name, low, high, across, hole_low, hole_high, material):
    """A wall from ``low`` to ``high`` with a hole through it along axis ``across``; the hole's corners have the two
    other coordinates."""
    low, high = np.array(low, float), np.array(high, float)
    u, v = (axis for axis in range(3) if axis != across)
    for start, stop in (
        ((low[u], low[v]), (hole_low[0], high[v])),
        ((hole_high[0], low[v]), (high[u], high[v])),
        ((hole_low[0], low[v]), (hole_high[0], hole_low[1])),
        ((hole_low[0], hole_high[1]), (hole_high[0], high[v])),
    ):
        part_low, part_high = low.copy(), high.copy()
        part_low[[u, v]], part_high[[u, v]] = start, stop
        if (part_high > part_low).all():
            scenes.add_box(scene, name, part_low, part_high, material)


def two_rooms_and_a_door():
    """A lamp in the first, a door of 90 cm in a wall of 10 cm."""
    scene, white = scenes.new_scene("Two rooms"), scenes.diffuse(WHITE)
    scenes.add_room_slabs(scene, (0, 0, 0), (6.1, 3, 2.5), 0.2, [white] * 6)
    walled(scene, "Between", (3, 0, 0), (3.1, 3, 2.5), 0, (1.2, 0), (2.1, 2.0), white)
    scenes.add_light(scene, "AREA", (1.5, 1.5, 2.45), shape="SQUARE", size=0.8, energy=60.0)
    return scene


def three_floors():
    """One above the other, each with a window; stairs' openings between."""
    scene, white = scenes.new_scene("Floors", (0.3, 0.4, 0.6)), scenes.diffuse(WHITE)
    for name, low, high in (
        ("Ground", (-0.2, -0.2, -0.2), (5.2, 4.2, 0)),
        ("Top", (-0.2, -0.2, 7.8), (5.2, 4.2, 8.0)),
        ("Back", (-0.2, 4, 0), (5.2, 4.2, 7.8)),
        ("Left", (-0.2, 0, 0), (0, 4, 7.8)),
        ("Right", (5, 0, 0), (5.2, 4, 7.8)),
    ):
        scenes.add_box(scene, name, low, high, white)
    for z in (0.0, 2.6, 5.2):
        walled(scene, "Front", (-0.2, -0.2, z), (5.2, 0, z + 2.6), 1, (3.2, z + 0.8), (4.4, z + 2.0), white)
    for z in (2.5, 5.1):
        walled(scene, "Slab", (0, 0, z), (5, 4, z + 0.1), 2, (0.2, 0.5), (1.4, 3.5), white)
    scenes.add_light(scene, "SUN", rotation=(0.87, 0, 0.26), energy=5.0, angle=0.01)
    return scene


def screens():
    """An open plan with screens of 4 cm and one of a single plane."""
    scene, white = scenes.new_scene("Screens"), scenes.diffuse(WHITE)
    scenes.add_room_slabs(scene, (0, 0, 0), (6, 5, 2.7), 0.2, [scenes.diffuse(WOOD), *[white] * 5])
    for y in (1.2, 2.5, 3.8):
        scenes.add_box(scene, "Screen", (0.8, y, 0), (3.6, y + 0.04, 1.7), scenes.diffuse((0.3, 0.4, 0.6)))
    scenes.add_plane(scene, "Plane", (4.6, 2.5, 1.2), (0, 1.5, 0), (0, 0, 1.2), scenes.diffuse((0.6, 0.6, 0.2)))
    scenes.add_light(scene, "POINT", (2.0, 1.8, 2.2), energy=60.0, shadow_soft_size=0.1)
    scenes.add_light(scene, "POINT", (5.3, 4.0, 2.0), energy=30.0, shadow_soft_size=0.1)
    return scene


def furnished():
    """A window, a table, a shelf and a sofa."""
    scene, white = scenes.new_scene("Furnished", (0.6, 0.7, 0.9)), scenes.diffuse(WHITE)
    for name, low, high in (
        ("Floor", (-0.2, -0.2, -0.2), (5.2, 4.2, 0)),
        ("Ceiling", (-0.2, -0.2, 2.6), (5.2, 4.2, 2.8)),
        ("Back", (-0.2, 4, 0), (5.2, 4.2, 2.6)),
        ("Front", (-0.2, -0.2, 0), (5.2, 0, 2.6)),
        ("Left", (-0.2, 0, 0), (0, 4, 2.6)),
    ):
        scenes.add_box(scene, name, low, high, white)
    walled(scene, "Window", (5, 0, 0), (5.2, 4, 2.6), 0, (1, 0.9), (3, 2.1), white)
    wood, blue = scenes.diffuse(WOOD), scenes.diffuse((0.2, 0.25, 0.5))
    scenes.add_box(scene, "Table", (1.6, 1.4, 0.7), (3.2, 2.4, 0.74), wood)
    for level in range(6):
        scenes.add_box(scene, "Shelf", (0.02, 0.3, 0.35 * level), (0.32, 3.0, 0.35 * level + 0.03), wood)
    scenes.add_box(scene, "Sofa", (1.2, 3.2, 0), (3.6, 3.95, 0.45), blue)
    scenes.add_box(scene, "Sofa's back", (1.2, 3.75, 0.45), (3.6, 3.95, 0.9), blue)
    scenes.add_light(scene, "SUN", rotation=(1.05, 0, 1.4), energy=5.0, angle=0.01)
    return scene


def spot_lit():
    """A museum's room: three spots on its wall, a dark floor."""
    scene, white = scenes.new_scene("Museum"), scenes.diffuse((0.85, 0.85, 0.85))
    scenes.add_room_slabs(scene, (0, 0, 0), (6, 4, 3), 0.15, [scenes.diffuse((0.08, 0.08, 0.09)), *[white] * 5])
    for x in (1, 3, 5):
        options = {"energy": 60.0, "spot_size": 0.87, "spot_blend": 0.4, "shadow_soft_size": 0.03}
        scenes.add_light(scene, "SPOT", (x, 2.5, 2.9), (-0.84, 0, 0), **options)
    scenes.add_box(scene, "Bench", (2.4, 1.2, 0), (3.6, 1.8, 0.45), scenes.diffuse(WOOD))
    return scene


def box(low, high, resolution, degrees=0.0):
    """The grid in the box ``low`` .. ``high``, turned about the vertical through its middle."""

    def grid(_scene):
        made = Grid.from_bounds(low, high, resolution)
        turn, matrix = np.radians(degrees), made.matrix.copy()
        matrix[:2, :2] = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ matrix[:2, :2]
        return Grid(matrix, made.resolution, made.name)

    return grid


def fitted(scene):
    return fit_volume(read_scene(scene))


def cornell(walls="thick", light="area"):
    return lambda: scenes.cornell(walls, light=light)


# name: (scene, grid of the scene)
ROOMS = {
    "door of 90 cm, cells of 0.5 m": (two_rooms_and_a_door, box((0.15, 0.15, 0.15), (5.95, 2.85, 2.35), (12, 7, 6))),
    "door of 90 cm, cells of 1 m": (two_rooms_and_a_door, box((0.15, 0.15, 0.15), (5.95, 2.85, 2.35), (6, 4, 3))),
    "door of 90 cm, turned by 20°": (two_rooms_and_a_door, box((-0.3, -0.8, 0.1), (6.4, 3.8, 2.4), (9, 6, 4), 20)),
    "three floors": (three_floors, box((-0.3, -0.5, -0.2), (5.3, 4.5, 8.0), (9, 8, 13))),
    "screens of 4 cm": (screens, box((0.2, 0.2, 0.2), (5.8, 4.8, 2.5), (10, 8, 5))),
    "screens, fitted volume": (screens, fitted),
    "furnished": (furnished, box((0.2, 0.2, 0.2), (4.8, 3.8, 2.4), (9, 7, 5))),
    "furnished, 10 cm into the walls": (furnished, box((-0.1, -0.1, -0.1), (5.1, 4.1, 2.7), (9, 7, 5))),
    "museum, fitted volume": (spot_lit, fitted),
    "museum, turned by 30°": (spot_lit, box((-0.4, -0.6, 0.2), (6.4, 4.6, 2.8), (9, 7, 5), 30)),
    "Cornell, 10 cm into the walls": (cornell(light="spot"), box((-0.1,) * 3, (2.9,) * 3, (5, 5, 5))),
    "Cornell, 18 cm into the walls": (cornell(), box((-0.18,) * 3, (2.98,) * 3, (4, 4, 4))),
    "Cornell of planes": (cornell("planes", "point"), box((-0.05,) * 3, (2.85,) * 3, (6, 6, 6))),
}
