# SPDX-License-Identifier: GPL-3.0-or-later
"""Patterns that no UV map carries, against Cycles: a box that glows with them, seen from inside."""

import bpy
import numpy as np
import pytest
from gridlight.core.panorama import panorama_directions
from gridlight.core.reference_scene import ReferenceScene
from gridlight.scene.cycles_reference import render_panoramas
from gridlight.scene.read import read_scene
from scene_builders import empty_scene, image, mesh, node, place, with_nodes

EYE = np.array([0.3, -0.2, 0.1])
SIZE = 64, 32
CORNERS = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def bands(tree):
    pixels = np.ones((8, 8, 4), np.float32)
    pixels[:, :4, 0] = 0.1
    pixels[:4, :, 1] = 0.1
    return image("bands", pixels)


def attribute(tree, name, kind="GEOMETRY", output="Color"):
    return node(tree, "ShaderNodeAttribute", attribute_name=name, attribute_type=kind).outputs[output]


def coordinates(tree, name):
    return node(tree, "ShaderNodeTexCoord").outputs[name]


def in_a_group(tree):
    group = bpy.data.node_groups.new("Inner", "ShaderNodeTree")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    exit_node = group.nodes.new("NodeGroupOutput")
    group.links.new(node(group, "ShaderNodeNewGeometry").outputs["Position"], exit_node.inputs[0])
    outer = tree.nodes.new("ShaderNodeGroup")
    outer.node_tree = group
    return node(tree, "ShaderNodeGamma", {"Color": outer.outputs[0], "Gamma": 2.0}).outputs[0]


PATTERNS = {
    "colours of corners": lambda tree: node(tree, "ShaderNodeVertexColor", layer_name="Paint").outputs["Color"],
    "the colour that renders show": lambda tree: node(tree, "ShaderNodeVertexColor").outputs["Color"],
    "numbers of vertices": lambda tree: attribute(tree, "dirt", output="Fac"),
    "a property of the object": lambda tree: attribute(tree, "tint", "OBJECT"),
    "the colour of the object": lambda tree: node(tree, "ShaderNodeObjectInfo").outputs["Color"],
    "the object's random number": lambda tree: node(tree, "ShaderNodeObjectInfo").outputs["Random"],
    "generated": lambda tree: coordinates(tree, "Generated"),
    "object": lambda tree: coordinates(tree, "Object"),
    "normals": lambda tree: node(tree, "ShaderNodeNewGeometry").outputs["Normal"],
    "a group": in_a_group,
    "an image from all sides": lambda tree: node(
        tree, "ShaderNodeTexImage", {"Vector": coordinates(tree, "Generated")}, image=bands(tree), projection="BOX"
    ).outputs["Color"],
    "waves": lambda tree: node(tree, "ShaderNodeTexWave", {"Scale": 0.5}).outputs["Color"],
}


@pytest.mark.parametrize("pattern", PATTERNS)
def test_patterns_are_those_of_cycles(pattern):
    scene = empty_scene()
    data = mesh("Box", CORNERS, FACES)
    made = bpy.data.materials.new("Subject")
    tree = with_nodes(made)
    glow = node(tree, "ShaderNodeEmission", {"Color": PATTERNS[pattern](tree)})
    node(tree, "ShaderNodeOutputMaterial", {"Surface": glow.outputs[0]})
    data.materials.append(made)
    random = np.random.default_rng(1)
    paint = data.color_attributes.new("Paint", "BYTE_COLOR", "CORNER")
    paint.data.foreach_set("color", random.uniform(0, 1, 4 * len(paint.data)).astype(np.float32))
    dirt = data.attributes.new("dirt", "FLOAT", "POINT")
    dirt.data.foreach_set("value", random.uniform(0, 1, len(dirt.data)).astype(np.float32))
    box = place(data, "Box", rotation_euler=(0.2, 0.4, 0.1), scale=(2, 1.5, -1), location=(0.2, 0, 0))
    box["tint"] = [0.8, 0.2, 0.5]
    box.color = (0.1, 0.3, 0.9, 1)
    snapshot = read_scene(scene)
    assert not snapshot.warnings

    seen = render_panoramas(scene, EYE[None], *SIZE, samples=16, bounces=0)[0]
    directions = panorama_directions(*SIZE).reshape(-1, 3)
    ours = ReferenceScene(snapshot, np.zeros(3))
    hits = ours.closest(np.broadcast_to(EYE, directions.shape), directions)
    found = ours.resolve(hits, directions, 0.0).emission.reshape(seen.shape)
    error = np.sqrt(((np.maximum(seen, 0) - np.maximum(found, 0)) ** 2).mean() / (seen**2).mean())
    assert error < 0.08  # one ray a pixel against 16
    assert found.mean(axis=(0, 1)) == pytest.approx(np.maximum(seen, 0).mean(axis=(0, 1)), rel=0.02, abs=0.01)
