# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes for tests and measurements, built with real bpy: each maker returns a new scene.

All surfaces are Diffuse BSDFs or emitters, so that a bake and a path tracer are asked the same question.
"""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Euler, Matrix, Vector

WHITE, RED, GREEN = (0.73, 0.73, 0.73), (0.63, 0.065, 0.05), (0.14, 0.45, 0.091)

ROOM_SIZE_M = 2.8  # of the Cornell-like room: its inside is 0..ROOM_SIZE_M along every axis
WALL_M = 0.2

# Front, in this order: floor, ceiling, back (+Y), front (−Y), left (−X), right (+X).
_ROOM_COLOURS = (WHITE, WHITE, WHITE, WHITE, RED, GREEN)


def new_scene(name: str, world=(0.0, 0.0, 0.0)) -> bpy.types.Scene:
    """An empty scene whose world is one colour."""
    scene = bpy.data.scenes.new(name)
    scene.world = bpy.data.worlds.new(name)
    scene.world.use_nodes = True
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*world, 1.0)
    background.inputs["Strength"].default_value = 1.0
    return scene


def save(scene, path) -> None:
    """Write a .blend that opens with ``scene`` as its active one."""
    bpy.context.window.scene = scene
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)


def diffuse(color, name: str = "Diffuse") -> bpy.types.Material:
    """A Diffuse BSDF."""
    return _material(name, "ShaderNodeBsdfDiffuse", "BSDF", Color=(*color, 1.0), Roughness=0.0)


def emitter(color, strength: float, name: str = "Emitter") -> bpy.types.Material:
    """A surface that emits radiance ``color`` × ``strength`` and reflects nothing."""
    return _material(name, "ShaderNodeEmission", "Emission", Color=(*color, 1.0), Strength=strength)


def _material(name: str, node_type: str, output: str, **inputs) -> bpy.types.Material:
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    shader = nodes.new(node_type)
    for key, value in inputs.items():
        shader.inputs[key].default_value = value
    links.new(shader.outputs[output], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def add_mesh(scene, name: str, vertices, faces, material, matrix=Matrix()) -> bpy.types.Object:
    """A mesh object of plain lists."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(map(float, vertex)) for vertex in vertices], [], faces)
    mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    thing.matrix_world = matrix
    scene.collection.objects.link(thing)
    return thing


def add_box(scene, name: str, low, high, material, turn: float = 0.0, inward: bool = False) -> bpy.types.Object:
    """A box with corners ``low`` and ``high``, turned about the vertical through its middle; ``inward``: normals point
    inside."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    middle, half = (low + high) / 2, (high - low) / 2
    vertices = [half * (x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    if inward:
        faces = [face[::-1] for face in faces]
    return add_mesh(
        scene, name, vertices, faces, material, Matrix.Translation(Vector(middle)) @ Matrix.Rotation(turn, 4, "Z")
    )


def add_plane(scene, name: str, middle, axis_u, axis_v, material) -> bpy.types.Object:
    """A rectangle ``middle`` ± ``axis_u`` ± ``axis_v`` that faces u × v."""
    middle, u, v = (np.asarray(value, float) for value in (middle, axis_u, axis_v))
    return add_mesh(
        scene, name, [middle - u - v, middle + u - v, middle + u + v, middle - u + v], [(0, 1, 2, 3)], material
    )


def add_light(
    scene, kind: str, location=(0, 0, 0), rotation=(0, 0, 0), scale=(1, 1, 1), **properties
) -> bpy.types.Object:
    """A light object; ``properties`` are those of ``bpy.types.Light``."""
    data = bpy.data.lights.new(kind.title(), kind)
    for key, value in properties.items():
        setattr(data, key, value)
    thing = bpy.data.objects.new(kind.title(), data)
    thing.location, thing.rotation_euler, thing.scale = location, Euler(rotation), scale
    scene.collection.objects.link(thing)
    return thing


def cornell(walls: str = "thick", boxes: bool = True, light: str = "area") -> bpy.types.Scene:
    """A closed room 2.8 m wide with a red and a green wall, two boxes and a light under the ceiling.

    Args:
        walls: "thick", six slabs of 20 cm; "planes", six single planes that face inside; "cube", one cube with its
        normals outside,
            as Blender adds it.
        light: "area", a light object; "strip", an emissive strip 4 cm wide along the ceiling; "spot"; "point".
    """
    scene = new_scene(f"Cornell {walls} {light}")
    size = ROOM_SIZE_M
    materials = {color: diffuse(color) for color in (WHITE, RED, GREEN)}
    if walls == "cube":
        room = add_box(scene, "Room", (0, 0, 0), (size, size, size), materials[WHITE])
        for color in (RED, GREEN):
            room.data.materials.append(materials[color])
        room.data.polygons[4].material_index, room.data.polygons[5].material_index = 1, 2
    elif walls == "planes":
        add_room_planes(scene, (0, 0, 0), (size, size, size), [materials[color] for color in _ROOM_COLOURS])
    elif walls == "thick":
        add_room_slabs(scene, (0, 0, 0), (size, size, size), WALL_M, [materials[color] for color in _ROOM_COLOURS])
    else:
        raise ValueError(f"no walls called {walls}")
    if boxes:
        add_box(scene, "Tall box", (0.65, 1.45, 0.0), (1.45, 2.25, 1.55), materials[WHITE], 0.29)
        add_box(scene, "Short box", (1.5, 0.5, 0.0), (2.25, 1.25, 0.75), materials[WHITE], -0.31)
    middle = size / 2
    if light == "area":
        add_light(scene, "AREA", (middle, middle, size - 0.04), shape="RECTANGLE", size=0.9, size_y=0.6, energy=40.0)
    elif light == "strip":
        add_box(
            scene,
            "Strip",
            (middle - 0.9, middle - 0.02, size - 0.06),
            (middle + 0.9, middle + 0.02, size - 0.02),
            emitter((1.0, 0.9, 0.8), 60.0),
        )
    elif light == "spot":
        add_light(
            scene,
            "SPOT",
            (0.5, 0.5, 2.5),
            (0.6, 0.0, -0.8),
            energy=120.0,
            spot_size=1.1,
            spot_blend=0.3,
            shadow_soft_size=0.05,
        )
    elif light == "point":
        add_light(scene, "POINT", (middle, middle, 2.2), energy=60.0, shadow_soft_size=0.05)
    else:
        raise ValueError(f"no light called {light}")
    return scene


def lit_and_dark_rooms(wall_m: float = 0.1) -> bpy.types.Scene:
    """Two closed white rooms 2.5 m wide side by side along X with a wall of ``wall_m`` between; a lamp in the first.

    The lit room is 0..2.5 along X, the dark one starts at 2.5 + ``wall_m``.
    """
    scene = new_scene("Lit and dark")
    white = diffuse(WHITE)
    second = 2.5 + wall_m
    low, high = -WALL_M, 2.5 + WALL_M
    far = second + 2.5
    add_box(scene, "Floor", (low, low, low), (far + WALL_M, high, 0.0), white)
    add_box(scene, "Ceiling", (low, low, 2.5), (far + WALL_M, high, high), white)
    add_box(scene, "Front", (low, low, 0.0), (far + WALL_M, 0.0, 2.5), white)
    add_box(scene, "Back", (low, 2.5, 0.0), (far + WALL_M, high, 2.5), white)
    add_box(scene, "Left", (low, 0.0, 0.0), (0.0, 2.5, 2.5), white)
    add_box(scene, "Right", (far, 0.0, 0.0), (far + WALL_M, 2.5, 2.5), white)
    add_box(scene, "Between", (2.5, 0.0, 0.0), (second, 2.5, 2.5), white)
    add_light(scene, "AREA", (1.25, 1.25, 2.45), shape="SQUARE", size=0.8, energy=40.0)
    return scene


def add_room_planes(scene, low, high, materials) -> None:
    """Six planes around the box ``low`` .. ``high`` that face inside; materials of floor, ceiling, +Y, −Y, −X, +X."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    middle, (x, y, z) = (low + high) / 2, np.diag((high - low) / 2)
    sides = (
        ("Floor", -z, x, y),
        ("Ceiling", z, y, x),
        ("Back", y, x, z),
        ("Front", -y, z, x),
        ("Left", -x, y, z),
        ("Right", x, z, y),
    )
    for (name, offset, u, v), material in zip(sides, materials):
        add_plane(scene, name, middle + offset, u, v, material)


def add_room_slabs(scene, low, high, thickness: float, materials) -> None:
    """Six slabs around the box ``low`` .. ``high``, overlapping nowhere; materials of floor, ceiling, +Y, −Y, −X,
    +X."""
    (x0, y0, z0), (x1, y1, z1), t = low, high, thickness
    boxes = (
        ("Floor", (x0 - t, y0 - t, z0 - t), (x1 + t, y1 + t, z0)),
        ("Ceiling", (x0 - t, y0 - t, z1), (x1 + t, y1 + t, z1 + t)),
        ("Back", (x0 - t, y1, z0), (x1 + t, y1 + t, z1)),
        ("Front", (x0 - t, y0 - t, z0), (x1 + t, y0, z1)),
        ("Left", (x0 - t, y0, z0), (x0, y1, z1)),
        ("Right", (x1, y0, z0), (x1 + t, y1, z1)),
    )
    for (name, box_low, box_high), material in zip(boxes, materials):
        add_box(scene, name, box_low, box_high, material)
