# SPDX-License-Identifier: GPL-3.0-or-later
"""What Explore mode's keys do to a scene, and how spheres are hit, without a window."""

import bpy
import numpy as np
import pytest
from gridlight.operators import explore_actions
from gridlight.viewport.picking import sphere_distances
from mathutils import Vector


def room(name, size, location, color):
    bpy.ops.mesh.primitive_cube_add(size=size, location=location)
    material = bpy.data.materials.new(name)
    if material.node_tree is None:
        material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (*color, 1)
    bpy.context.object.data.materials.append(material)
    return material


def lamp(group):
    item = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    bpy.context.scene.collection.objects.link(item)
    item.gridlight_light.group = group
    return item


def test_a_group_goes_down_to_dark_and_comes_back(scene):
    first, second, other = lamp("WALL"), lamp("WALL"), lamp("CEILING_1")
    second.gridlight_light.intensity = 2.0
    for _ in range(40):
        value = explore_actions.change_intensity(scene, "WALL", False)
    assert value == 0.0 and second.gridlight_light.intensity == 0.0 and other.gridlight_light.intensity == 1.0
    for _ in range(14):
        value = explore_actions.change_intensity(scene, "WALL", True)
    assert value > 1.0 and first.gridlight_light.intensity == pytest.approx(value)
    assert explore_actions.change_intensity(scene, "CEILING_2", True) is None


def test_intensity_reaches_lamps_and_things_that_glow(scene):
    from gridlight.scene.read import read_lights, read_scene

    item = lamp("WALL")
    material = room("glass", 1.0, (0, 0, 5), (0.8, 0.8, 0.8))
    material.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 2.0
    glowing = bpy.context.object
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(4, 0, 5))
    bpy.context.object.data.materials.append(material)  # the same material at its own strength
    before = read_scene(scene)
    item.gridlight_light.intensity, glowing.gridlight_light.intensity = 0.25, 3.0
    bpy.context.view_layer.update()
    after = read_scene(scene)
    np.testing.assert_allclose(after.lights[0].color, np.multiply(before.lights[0].color, 0.25))
    emitted = np.array([after.materials[index].emission for index in np.unique(after.material_index)])
    np.testing.assert_allclose(sorted(emitted[:, 0]), np.array([1.0, 3.0]) * before.materials[0].emission[0], rtol=1e-6)
    live = read_scene(scene, live=True)
    assert [light.color for light in read_lights(scene, bpy.context.view_layer)] == [
        light.color for light in live.lights
    ]


def test_walls_are_those_around_the_eye_unless_marked(scene):
    inner = room("inner", 4.0, (0, 0, 0), (0.8, 0.8, 0.8))
    outer = room("outer", 40.0, (0, 0, 0), (0.5, 0.5, 0.5))
    bpy.context.view_layer.update()
    assert explore_actions.wall_materials(bpy.context, Vector((0.5, 0.2, 0.1))) == [inner]
    assert explore_actions.wall_materials(bpy.context, Vector((10.0, 0.2, 3.1))) == [outer]
    outer[explore_actions.WALL_MARK] = 1
    assert explore_actions.wall_materials(bpy.context, Vector((0.5, 0.2, 0.1))) == [outer]
    explore_actions.paint([outer], -1)
    color = outer.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value
    np.testing.assert_allclose(color[:3], explore_actions.WALL_COLORS[-1], rtol=1e-6)
    assert explore_actions.wall_materials(bpy.context, Vector((1000.0, 0, 0))) == [outer]


def test_screenshots_do_not_overwrite_each_other(scene, tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "museum.blend"))
    first = explore_actions.screenshot_path()
    assert first == tmp_path / "museum_0001.png"
    first.write_bytes(b"")
    assert explore_actions.screenshot_path() == tmp_path / "museum_0002.png"


def test_rays_meet_spheres_where_geometry_says():
    centres = np.array([[10.0, 0, 0], [20.0, 0.5, 0], [-10.0, 0, 0], [0.5, 0, 0], [10.0, 3.0, 0]])
    radius = np.full(5, 1.0)
    distance = sphere_distances(centres, radius, np.zeros(3), np.array([1.0, 0, 0]))
    expected = [9.0, 20.0 - np.sqrt(0.75), np.inf, np.inf, np.inf]  # hit, grazed, behind, too near, missed
    np.testing.assert_allclose(distance, expected)
