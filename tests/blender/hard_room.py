# SPDX-License-Identifier: GPL-3.0-or-later
"""One room as a .blend, for hard cases: each changes something about it and knows what must come out."""

import bpy
import numpy as np
from gridlight.bake.bake_job import BakeJob
from gridlight.core import lookup
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.tests import scenes
from mathutils import Matrix, Vector

SIX = np.concatenate([np.eye(3), -np.eye(3)])


def run(snapshot, grid, **settings):
    from gridlight.bake.job import run_bake
    from gridlight.cli.progress import Reporter

    settings = {"face": 8, **settings}
    return run_bake(BakeJob(snapshot, grid, BakeSettings(**settings)), Reporter(quiet=True), lambda: False)


def irradiance(result, points):
    found = lookup.irradiance(result.field, np.repeat(points, 6, axis=0), np.tile(SIX, (len(points), 1)))
    return found.reshape(len(points), 6, 3)


def difference(found, expected):
    return np.sqrt(((found - expected) ** 2).mean() / (expected**2).mean())


def room(offset=(0.0, 0.0, 0.0), scale=1.0, material=None, lamp=True):
    """A closed room 2.5 m wide with a block in it; every length is a whole number of 1/64 m, so that its place can be
    told to the last bit 100 km away."""
    scene = scenes.new_scene("Hard")
    grey = material or scenes.diffuse((0.7, 0.6, 0.5))
    boxes = [
        ((-0.25, -0.25, -0.25), (2.75, 2.75, 0.0)),
        ((-0.25, -0.25, 2.5), (2.75, 2.75, 2.75)),
        ((-0.25, 2.5, 0.0), (2.75, 2.75, 2.5)),
        ((-0.25, -0.25, 0.0), (2.75, 0.0, 2.5)),
        ((-0.25, 0.0, 0.0), (0.0, 2.5, 2.5)),
        ((2.5, 0.0, 0.0), (2.75, 2.5, 2.5)),
        ((0.75, 1.25, 0.0), (1.25, 1.75, 1.0)),
    ]
    for low, high in boxes:
        scenes.add_box(scene, "Box", low, high, grey)
    if lamp:
        scenes.add_light(scene, "POINT", (1.75, 0.75, 2.0), energy=50.0 * scale**2, shadow_soft_size=0.0)
    place = Matrix.Translation(Vector(offset)) @ Matrix.Scale(scale, 4)
    for item in scene.objects:
        item.matrix_world = place @ item.matrix_basis
    bpy.context.window.scene = scene
    bpy.context.view_layer.update()
    return scene


def volume(offset=(0.0, 0.0, 0.0), scale=1.0):
    """Nothing in it lines up with the room: rays that meet an edge exactly may go either way."""
    low = np.array([0.27, 0.233, 0.251]) * scale + offset
    return Grid.from_bounds(low, low + 2.0 * scale, (4, 4, 4))


def textured(image, name="Textured"):
    """A Diffuse BSDF coloured by ``image`` through the active UV map."""
    material = scenes.diffuse((0.9, 0.1, 0.9), name)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    shader = next(node for node in nodes if node.type == "BSDF_DIFFUSE")
    links.new(texture.outputs["Color"], shader.inputs["Color"])
    return material
