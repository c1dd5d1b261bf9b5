# SPDX-License-Identifier: GPL-3.0-or-later
"""Colour and number nodes against Cycles, pixel by pixel, on a texture of random colours."""

import bpy
import numpy as np
import pytest
from gridlight.scene.flat_render import render_socket
from gridlight.scene.images import ImageTable
from gridlight.scene.notices import Notices
from gridlight.scene.shader_nodes import NodeEvaluator
from scene_builders import empty_scene, image, node, with_nodes

EDGE = 16
RANDOM = np.random.default_rng(1)
PIXELS = RANDOM.random((EDGE, EDGE, 4)).astype(np.float32)
PIXELS[..., 3] = 1
OTHER = RANDOM.random((EDGE, EDGE, 4)).astype(np.float32)
OTHER[..., 3] = 1


@pytest.fixture
def tree():
    empty_scene()
    material = bpy.data.materials.new("under test")
    return with_nodes(material)


def texture(tree, pixels=PIXELS):
    return node(tree, "ShaderNodeTexImage", image=image("texture", pixels), interpolation="Closest").outputs["Color"]


def check(tree, socket, tolerance=2e-5):
    """The evaluator's pixels of ``socket`` equal those of Cycles."""
    material = next(item for item in bpy.data.materials if item.node_tree == tree)
    notices = Notices()
    evaluator = NodeEvaluator("material 'under test'", ImageTable(notices), notices, "under test")
    value = np.broadcast_to(evaluator.output(socket, None).array(), (EDGE, EDGE, 3))
    assert not notices.lines()
    assert np.allclose(value, render_socket(material, socket, None, EDGE), atol=tolerance, rtol=tolerance)
    assert np.ptp(value) > 0


def test_plain_texture(tree):
    check(tree, texture(tree))


BLENDS = [item.identifier for item in bpy.types.ShaderNodeMixRGB.bl_rna.properties["blend_type"].enum_items]


@pytest.mark.parametrize("blend", BLENDS)
@pytest.mark.parametrize("factor", [0.3, 1.0])
def test_mix_color(tree, blend, factor):
    made = node(
        tree,
        "ShaderNodeMix",
        {"Factor_Float": factor, "A_Color": texture(tree), "B_Color": texture(tree, OTHER)},
        data_type="RGBA",
        blend_type=blend,
    )
    check(tree, made.outputs["Result_Color"] if "Result_Color" in made.outputs else made.outputs[2], 1e-4)


def test_mix_with_constant_and_clamping(tree):
    made = node(
        tree,
        "ShaderNodeMix",
        {"Factor_Float": 1.7, "A_Color": texture(tree), "B_Color": (0.9, 0.1, 2, 1)},
        data_type="RGBA",
        blend_type="ADD",
        clamp_factor=True,
        clamp_result=True,
    )
    check(tree, made.outputs[2])


def test_old_mix_node_with_a_textured_factor(tree):
    made = node(
        tree, "ShaderNodeMixRGB", {"Fac": texture(tree), "Color1": (1, 0, 0, 1), "Color2": texture(tree, OTHER)}
    )
    check(tree, made.outputs[0], 1e-4)  # Cycles' luminance weights have more digits


MATH = [
    "ADD",
    "SUBTRACT",
    "MULTIPLY",
    "DIVIDE",
    "MULTIPLY_ADD",
    "POWER",
    "LOGARITHM",
    "SQRT",
    "INVERSE_SQRT",
    "ABSOLUTE",
    "EXPONENT",
    "MINIMUM",
    "MAXIMUM",
    "LESS_THAN",
    "GREATER_THAN",
    "SIGN",
    "COMPARE",
    "ROUND",
    "FLOOR",
    "CEIL",
    "TRUNC",
    "FRACT",
    "MODULO",
    "FLOORED_MODULO",
    "WRAP",
    "SNAP",
    "PINGPONG",
    "SINE",
    "COSINE",
    "TANGENT",
    "ARCTANGENT",
    "ARCTAN2",
    "RADIANS",
    "DEGREES",
]


@pytest.mark.parametrize("operation", MATH)
def test_math(tree, operation):
    made = node(
        tree, "ShaderNodeMath", {"Value": texture(tree), "Value_001": 0.37, "Value_002": 0.21}, operation=operation
    )
    material = next(item for item in bpy.data.materials if item.node_tree == tree)
    notices = Notices()
    evaluator = NodeEvaluator("m", ImageTable(notices), notices, "m")
    value = np.broadcast_to(evaluator.output(made.outputs[0], None).array(), (EDGE, EDGE, 3))
    assert np.allclose(value, render_socket(material, made.outputs[0], None, EDGE), atol=5e-4, rtol=5e-4)


@pytest.mark.parametrize(
    ("kind", "color", "inputs"),
    [
        ("ShaderNodeGamma", "Color", {"Gamma": 2.2}),
        ("ShaderNodeBrightContrast", "Color", {"Bright": 0.1, "Contrast": 0.4}),
        ("ShaderNodeHueSaturation", "Color", {"Hue": 0.7, "Saturation": 1.4, "Value": 0.8, "Fac": 0.6}),
        ("ShaderNodeInvert", "Color", {"Fac": 0.75}),
        ("ShaderNodeRGBToBW", "Color", {}),
        ("ShaderNodeClamp", "Value", {"Min": 0.3, "Max": 0.6}),
        ("ShaderNodeMapRange", "Value", {"From Min": 0.2, "From Max": 0.8, "To Min": 1.0, "To Max": 0.0}),
    ],
)
def test_color_nodes(tree, kind, color, inputs):
    made = node(tree, kind, {color: texture(tree), **inputs})
    check(tree, made.outputs[0], 1e-4)


@pytest.mark.parametrize("interpolation", ["SMOOTHSTEP", "SMOOTHERSTEP"])
def test_smooth_map_range(tree, interpolation):
    made = node(tree, "ShaderNodeMapRange", {"Value": texture(tree), "To Max": 3.0}, interpolation_type=interpolation)
    check(tree, made.outputs[0], 5e-4)


@pytest.mark.parametrize("interpolation", ["LINEAR", "EASE", "B_SPLINE"])
def test_color_ramp(tree, interpolation):
    made = node(tree, "ShaderNodeValToRGB", {"Fac": texture(tree)})
    made.color_ramp.interpolation = interpolation
    made.color_ramp.elements[0].color = (1, 0.2, 0, 1)
    made.color_ramp.elements.new(0.4).color = (0, 0.5, 1, 1)
    check(tree, made.outputs["Color"], 3e-3)  # Cycles has a table of 256 entries, so two tables differ between them


def test_curves(tree):
    made = node(tree, "ShaderNodeRGBCurve", {"Color": texture(tree), "Fac": 0.8})
    made.mapping.curves[3].points.new(0.4, 0.7)
    made.mapping.curves[0].points.new(0.5, 0.2)
    made.mapping.update()
    check(tree, made.outputs[0], 3e-3)


@pytest.mark.parametrize("mode", ["RGB", "HSV"])
def test_separate_and_combine(tree, mode):
    parts = node(tree, "ShaderNodeSeparateColor", {"Color": texture(tree)}, mode=mode)
    made = node(
        tree, "ShaderNodeCombineColor", {"Red": parts.outputs[0], "Green": 0.4, "Blue": parts.outputs[2]}, mode=mode
    )
    check(tree, made.outputs[0], 1e-4)


def test_blackbody_in_a_mix(tree):
    body = node(tree, "ShaderNodeBlackbody", {"Temperature": 3000.0})
    made = node(
        tree,
        "ShaderNodeMix",
        {"Factor_Float": 0.5, "A_Color": texture(tree), "B_Color": body.outputs[0]},
        data_type="RGBA",
    )
    check(tree, made.outputs[2], 5e-3)


def test_groups_reroutes_and_muted_nodes(tree):
    group = bpy.data.node_groups.new("Tint", "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    entry, exit_node = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    inverted = node(group, "ShaderNodeInvert", {"Color": entry.outputs[0], "Fac": 1.0})
    group.links.new(inverted.outputs[0], exit_node.inputs[0])
    muted = node(tree, "ShaderNodeGamma", {"Color": texture(tree), "Gamma": 9.0}, mute=True)
    reroute = tree.nodes.new("NodeReroute")
    tree.links.new(muted.outputs[0], reroute.inputs[0])
    outer = tree.nodes.new("ShaderNodeGroup")
    outer.node_tree = group
    tree.links.new(reroute.outputs[0], outer.inputs[0])
    last = node(tree, "ShaderNodeGamma", {"Color": outer.outputs[0], "Gamma": 1.3})
    check(tree, last.outputs[0], 1e-4)


def test_muted_group_passes_through(tree):
    group = bpy.data.node_groups.new("Nothing", "ShaderNodeTree")
    group.interface.new_socket("In", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Out", in_out="OUTPUT", socket_type="NodeSocketColor")
    outer = tree.nodes.new("ShaderNodeGroup")
    outer.node_tree, outer.mute = group, True
    tree.links.new(texture(tree), outer.inputs[0])
    last = node(tree, "ShaderNodeGamma", {"Color": outer.outputs[0], "Gamma": 1.3})
    check(tree, last.outputs[0], 1e-4)


@pytest.mark.parametrize("kind", ["POINT", "TEXTURE", "VECTOR"])
def test_mapping_agrees_with_cycles(tree, kind):
    """The texture's domain, sampled at the pixel centres of the square, gives what Cycles shows."""
    coordinates = node(tree, "ShaderNodeTexCoord")
    mapping = node(
        tree,
        "ShaderNodeMapping",
        {
            "Vector": coordinates.outputs["UV"],
            "Location": (0.31, 0.17, 0.4),
            "Rotation": (0.2, 0.1, 0.9),
            "Scale": (1.3, 0.7, 2.0),
        },
        vector_type=kind,
    )
    shown = node(
        tree,
        "ShaderNodeTexImage",
        {"Vector": mapping.outputs[0]},
        image=image("texture", PIXELS),
        interpolation="Closest",
    )
    notices = Notices()
    material = next(item for item in bpy.data.materials if item.node_tree == tree)
    value = NodeEvaluator("m", ImageTable(notices), notices, "m").output(shown.outputs["Color"], None)
    u, v = np.meshgrid((np.arange(256) + 0.5) / 256, (np.arange(256) + 0.5) / 256)
    matrix = np.array(value.domain.matrix).reshape(2, 3)
    place = np.stack([u, v, np.ones_like(u)], -1) @ matrix.T
    column, row = np.moveaxis(np.floor(place * EDGE).astype(int) % EDGE, -1, 0)
    rendered = render_socket(material, shown.outputs["Color"], None, 256)
    same = np.abs(value.pixels[row, column] - rendered).max(axis=-1) < 1e-4
    assert same.mean() > 0.85  # pixels across a texel's edge may take either side
    inside = np.abs((place * EDGE) % 1 - 0.5).max(axis=-1) < 0.35
    assert same[inside].mean() > 0.995
