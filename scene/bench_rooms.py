# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms for benchmarks: a Cornell box, and a hall that looks the same with any number of triangles."""

from __future__ import annotations

import bpy
import numpy as np

_WHITE, _RED, _GREEN = (0.73, 0.73, 0.73), (0.63, 0.065, 0.05), (0.14, 0.45, 0.091)  # Cornell University's, as RGB
CORNELL_EDGE_M = 2.8
HALL_SIZE_M = np.array([12.0, 9.0, 5.0])
_HALL_BALLS = 16


def build_cornell(scene: bpy.types.Scene) -> bpy.types.Scene:
    """A closed room of slabs, 0 .. CORNELL_EDGE_M along every axis inside, with two boxes and an area light."""
    edge, wall = CORNELL_EDGE_M, 0.2
    tints = {"white": _WHITE, "red": _RED, "green": _GREEN}
    colours = {name: diffuse_material(name, color) for name, color in tints.items()}
    slabs = {
        "Floor": ((-wall, -wall, -wall), (edge + wall, edge + wall, 0), "white"),
        "Ceiling": ((-wall, -wall, edge), (edge + wall, edge + wall, edge + wall), "white"),
        "Back": ((-wall, edge, 0), (edge + wall, edge + wall, edge), "white"),
        "Front": ((-wall, -wall, 0), (edge + wall, 0, edge), "white"),
        "Left": ((-wall, 0, 0), (0, edge, edge), "red"),
        "Right": ((edge, 0, 0), (edge + wall, edge, edge), "green"),
    }
    for name, (low, high, colour) in slabs.items():
        _add(scene, name, *_box(low, high), colours[colour])
    _add(scene, "Tall box", *_box((0.65, 1.45, 0.0), (1.45, 2.25, 1.55), 0.29), colours["white"])
    _add(scene, "Short box", *_box((1.5, 0.5, 0.0), (2.25, 1.25, 0.75), -0.31), colours["white"])
    _add_light(scene, (edge / 2, edge / 2, edge - 0.04), (0.9, 0.6), 40.0)
    return _dark(scene)


def build_hall(scene: bpy.types.Scene, triangles: int) -> bpy.types.Scene:
    """A closed hall of HALL_SIZE_M from the origin, with uneven walls and balls, in about ``triangles`` triangles: half
    in the walls, half in the balls. Only how finely they are cut differs, so light and sight stay about the same."""
    material = diffuse_material("plaster", (0.6, 0.55, 0.5))
    cuts = max(1, round((triangles / 2 / 12) ** 0.5))
    for axis in range(3):
        for side in (0, 1):
            _add(scene, f"Wall {axis}{side}", *_wall(axis, side, cuts), material)
    rings = max(3, round((triangles / 2 / _HALL_BALLS / 4) ** 0.5))
    for index, place in enumerate(_ball_places()):
        _add(scene, f"Ball {index}", *_ball(place, 0.35, rings), material)
    _add_light(scene, (0.3 * HALL_SIZE_M[0], 0.5 * HALL_SIZE_M[1], 0.9 * HALL_SIZE_M[2]), (2.0, 1.0), 400.0)
    _add_light(scene, (0.75 * HALL_SIZE_M[0], 0.3 * HALL_SIZE_M[1], 0.9 * HALL_SIZE_M[2]), (0.6, 0.6), 250.0)
    return _dark(scene)


def _wall(axis: int, side: int, cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and quads of one uneven side of the hall. Edges are even, so neighbours meet without a gap."""
    u, v = (axis + 1) % 3, (axis + 2) % 3
    grid = np.stack(np.meshgrid(np.linspace(0, 1, cuts + 1), np.linspace(0, 1, cuts + 1), indexing="ij"), axis=-1)
    vertices = np.zeros((cuts + 1, cuts + 1, 3))
    vertices[..., u], vertices[..., v] = grid[..., 0] * HALL_SIZE_M[u], grid[..., 1] * HALL_SIZE_M[v]
    bumps = np.prod(np.sin(np.pi * np.array([9, 7]) * grid) * np.sin(np.pi * grid), axis=-1)
    vertices[..., axis] = side * HALL_SIZE_M[axis] + 0.06 * bumps
    return vertices.reshape(-1, 3), _quads(cuts, cuts, cuts + 1, flip=bool(side))


def _ball(place, radius: float, rings: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and quads of a ball with ``rings`` × 2·rings of them; its poles are tiny squares' edges, not points."""
    polar, around = np.linspace(1e-3, np.pi - 1e-3, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings + 1)
    p, a = np.meshgrid(polar, around, indexing="ij")
    vertices = np.stack([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)], axis=-1) * radius + place
    return vertices.reshape(-1, 3), _quads(rings, 2 * rings, 2 * rings + 1)


def _ball_places() -> np.ndarray:
    """(N, 3): spread evenly (Roberts' R3 sequence), a metre from the walls."""
    steps = 1 / 1.2207440846057596 ** np.arange(1, 4)
    return 1.0 + (np.outer(np.arange(1, _HALL_BALLS + 1), steps) % 1.0) * (HALL_SIZE_M - 2.0)


def _quads(rows: int, columns: int, stride: int, flip: bool = False) -> np.ndarray:
    first = (np.arange(rows)[:, None] * stride + np.arange(columns)).reshape(-1, 1)
    quads = first + [0, stride, stride + 1, 1]
    return quads[:, ::-1] if flip else quads


def _box(low, high, turn: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and quads of a box, turned about the vertical through its middle."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    corners = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]) * (high - low) / 2
    c, s = np.cos(turn), np.sin(turn)
    vertices = corners @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + (low + high) / 2
    return vertices, np.array([(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])


def _add(scene, name: str, vertices: np.ndarray, quads: np.ndarray, material) -> None:
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", vertices.astype(np.float32).ravel())
    mesh.loops.add(quads.size)
    mesh.loops.foreach_set("vertex_index", quads.astype(np.int32).ravel())
    mesh.polygons.add(len(quads))
    mesh.polygons.foreach_set("loop_start", np.arange(0, quads.size, 4, dtype=np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_flat()  # meshes that are made this way are smooth, and boxes would be shaded as balls
    mesh.materials.append(material)
    scene.collection.objects.link(bpy.data.objects.new(name, mesh))


def _add_light(scene, place, size, power: float) -> None:
    data = bpy.data.lights.new("Lamp", "AREA")
    data.shape, data.size, data.size_y, data.energy = "RECTANGLE", *size, power
    lamp = bpy.data.objects.new("Lamp", data)
    lamp.location = place
    scene.collection.objects.link(lamp)


def diffuse_material(name: str, color) -> bpy.types.Material:
    """A Principled BSDF that only reflects diffusely: the glTF exporter knows no Diffuse BSDF."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*color, 1.0)
    shader.inputs["Roughness"].default_value = 1.0
    shader.inputs["Specular IOR Level"].default_value = 0.0
    return material


def _dark(scene: bpy.types.Scene) -> bpy.types.Scene:
    """``scene`` with a black world and everything evaluated."""
    scene.world = bpy.data.worlds.new("Dark")
    scene.world.use_nodes = True
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    scene.view_layers[0].update()
    return scene
