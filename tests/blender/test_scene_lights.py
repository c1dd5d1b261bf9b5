# SPDX-License-Identifier: GPL-3.0-or-later
"""Light units against Cycles: the irradiance that the snapshot's numbers give by closed forms is what Cycles shows."""

import math

import bpy
import numpy as np
import pytest
from gridlight.scene.cycles_reference import render_panoramas
from gridlight.scene.read import read_scene
from scene_builders import empty_scene, material, node, place, quad, with_nodes

HEIGHT = 2.0  # metres from the light to the lit point


@pytest.fixture
def scene():
    made = empty_scene()
    floor = quad("floor")
    floor.materials.append(material("white", inputs={"Color": (1, 1, 1, 1)}))
    place(floor, scale=(50, 50, 1))
    return made


def lamp(kind, scale=(1, 1, 1), **properties):
    data = bpy.data.lights.new("lamp", kind)
    data.energy = 10.0
    for name, value in properties.items():
        setattr(data, name, value)
    return place(data, "lamp", location=(0, 0, HEIGHT), scale=scale)


def cycles_irradiance(scene):
    """(3,) irradiance of the floor under the light, from the radiance that a white diffuse surface sends up."""
    panorama = render_panoramas(scene, [(0, 0, 0.01)], 16, 8, 256, bounces=0)[0]
    return panorama[0].mean(axis=0) * math.pi


def closed_form(light):
    """(3,) irradiance HEIGHT metres below ``light`` by the snapshot's units."""
    color = np.array(light.color)
    if light.kind == "SUN":
        return color
    if light.kind == "AREA":
        if light.shape == "ELLIPSE" and light.size_x == light.size_y:
            radius = light.size_x / 2
            return color * math.pi * radius**2 / (radius**2 + HEIGHT**2)
        grid = (np.arange(200) + 0.5) / 200 - 0.5
        x, y = np.meshgrid(grid * light.size_x, grid * light.size_y)
        inside = (
            np.ones_like(x)
            if light.shape == "RECTANGLE"
            else ((2 * x / light.size_x) ** 2 + (2 * y / light.size_y) ** 2 <= 1)
        )
        cell = light.size_x * light.size_y / 200**2
        return color * cell * (inside * HEIGHT**2 / (x * x + y * y + HEIGHT**2) ** 2).sum()
    falloff = HEIGHT**2 + (light.radius**2 if light.soft_falloff else 0.0)
    return color / falloff


@pytest.mark.parametrize(
    ("kind", "properties"),
    [
        ("POINT", {"shadow_soft_size": 0.0}),
        ("POINT", {"shadow_soft_size": 0.5, "exposure": 1.5, "color": (1, 0.5, 0.25)}),
        ("POINT", {"shadow_soft_size": 0.5, "scale": (3, 3, 3)}),
        ("POINT", {"shadow_soft_size": 0.5, "use_soft_falloff": False}),
        ("POINT", {"shadow_soft_size": 0.5, "normalize": False}),
        ("POINT", {"shadow_soft_size": 0.0, "normalize": False}),
        ("POINT", {"shadow_soft_size": 0.0, "use_temperature": True, "temperature": 2700.0}),
        ("SPOT", {"shadow_soft_size": 0.2, "spot_size": 1.0, "spot_blend": 0.2}),
        ("SUN", {"angle": 0.0}),
        ("SUN", {"angle": 0.3}),
        ("SUN", {"angle": 0.5, "normalize": False}),
        ("AREA", {"shape": "SQUARE", "size": 0.8}),
        ("AREA", {"shape": "RECTANGLE", "size": 0.8, "size_y": 0.3}),
        ("AREA", {"shape": "DISK", "size": 0.8}),
        ("AREA", {"shape": "ELLIPSE", "size": 0.8, "size_y": 0.3, "scale": (2, 1, 1)}),
        ("AREA", {"shape": "SQUARE", "size": 0.5, "scale": (2, 3, 1)}),
        ("AREA", {"shape": "SQUARE", "size": 0.5, "scale": (2, 3, 1), "normalize": False}),
    ],
    ids=lambda value: "-".join(f"{key}={item}" for key, item in value.items()) if isinstance(value, dict) else value,
)
def test_units(scene, kind, properties):
    lamp(kind, **properties)
    (light,) = read_scene(scene).lights
    assert closed_form(light) == pytest.approx(cycles_irradiance(scene), rel=0.01)


def test_nodes_multiply(scene):
    item = lamp("POINT", shadow_soft_size=0.0)
    tree = with_nodes(item.data)
    body = node(tree, "ShaderNodeBlackbody", {"Temperature": 4000.0})
    shader = node(tree, "ShaderNodeEmission", {"Color": body.outputs[0], "Strength": 3.0})
    node(tree, "ShaderNodeOutputLight", {"Surface": shader.outputs[0]})
    (light,) = read_scene(scene).lights
    assert closed_form(light) == pytest.approx(cycles_irradiance(scene), rel=0.01)


def test_frames_are_orthonormal_and_shine_the_right_way(scene):
    item = lamp("AREA", scale=(2, 3, 0.5))
    item.rotation_euler = (0.5, 0.4, 0.3)
    (light,) = read_scene(scene).lights
    axes = light.matrix[:3, :3]
    assert np.allclose(axes.T @ axes, np.eye(3), atol=1e-6)
    assert np.allclose(axes[:, 2], np.array(item.matrix_world.to_3x3().normalized().col[2]), atol=1e-6)
    assert np.allclose(light.matrix[:3, 3], [0, 0, HEIGHT])


def test_what_adds_no_diffuse_light_is_left_out(scene):
    lamp("AREA").data.cycles.is_portal = True
    lamp("POINT").visible_diffuse = False
    lamp("POINT", energy=0.0)
    assert read_scene(scene).lights == []


def test_negative_light_is_kept_and_named(scene):
    lamp("POINT", energy=-5.0)
    snapshot = read_scene(scene)
    assert snapshot.lights[0].color[0] < 0
    assert any("negative" in line and "lamp" in line for line in snapshot.warnings)


def test_roles(scene):
    still, marked, moved, driven, flickering = (lamp("POINT") for _ in range(5))
    marked["gridlight_role"] = "dynamic"
    still["gridlight_group"] = "ceiling 1"
    parent = place(None, "carrier")
    parent.keyframe_insert("location", frame=1)
    moved.parent = parent
    driven.driver_add("location", 0).driver.expression = "frame"
    flickering.data.keyframe_insert("energy", frame=1)
    lights = read_scene(scene).lights
    assert [light.dynamic for light in lights] == [False, True, True, True, True]
    assert [light.group for light in lights] == ["ceiling 1", "", "", "", ""]


def test_no_shadow(scene):
    lamp("SUN", use_shadow=False)
    assert read_scene(scene).lights[0].casts_shadow is False


@pytest.mark.parametrize("kind", ["POINT", "SPOT"])
def test_nodes_that_differ_with_direction(scene, kind):
    """Half of the directions are dark, to one side of the lamp."""
    light = lamp(kind, energy=40.0, shadow_soft_size=0.0)
    light.rotation_euler = (0.2, 0.1, 0.4)
    tree = with_nodes(light.data)
    direction = node(tree, "ShaderNodeTexCoord").outputs["Normal"]
    side = node(tree, "ShaderNodeSeparateXYZ", {"Vector": direction}).outputs["X"]
    lit = node(tree, "ShaderNodeMath", {"Value": side, "Value_001": 0.0}, operation="GREATER_THAN").outputs[0]
    glow = node(tree, "ShaderNodeEmission", {"Color": (1, 0.5, 0.25, 1), "Strength": lit})
    node(tree, "ShaderNodeOutputLight", {"Surface": glow.outputs[0]})
    blocks = len(bpy.data.scenes), len(bpy.data.lights), len(bpy.data.meshes)
    snapshot = read_scene(scene)
    assert snapshot.lights[0].color == pytest.approx(np.full(3, 40 / (4 * math.pi))) and not snapshot.warnings
    sides = np.array([[0.2, 0.1, -1.0], [-0.2, 0.1, -1.0]])
    factors = snapshot.lights[0].profile.factor(sides, np.ones(2))
    assert factors[0] == pytest.approx(np.array([1, 0.5, 0.25]), rel=0.01) and not factors[1].any()
    assert blocks == (len(bpy.data.scenes), len(bpy.data.lights), len(bpy.data.meshes))


def test_a_sheared_spot_shines_along_its_own_coordinates(scene):
    """A child turned under a parent that stretches: where the cone's axis is, x and y of the object are 0."""
    parent = place(None, "Parent", scale=(3, 1, 1))
    spot = place(bpy.data.lights.new("Spot", "SPOT"), "Spot", parent=parent, rotation_euler=(0.3, 0.8, 0.2))
    bpy.context.view_layer.update()
    light = read_scene(scene).lights[0]
    matrix = np.array(spot.matrix_world)[:3, :3]
    for direction in np.random.default_rng(1).normal(size=(5, 3)):
        expected = np.linalg.solve(matrix, direction)
        frame, scale = light.matrix[:3, :3], np.array(light.spot_scale)
        found = direction @ frame * (scale[2] / scale)
        np.testing.assert_allclose(found / np.linalg.norm(found), expected / np.linalg.norm(expected), atol=1e-6)
