# SPDX-License-Identifier: GPL-3.0-or-later
"""The world's radiance, its layout and the Cycles panoramas in the same layout."""

import math

import bpy
import numpy as np
import pytest
from gridlight.core.panorama import (
    panorama_coordinates,
    panorama_directions,
    panorama_irradiance,
    panorama_solid_angles,
)
from gridlight.scene.cycles_reference import render_panoramas
from gridlight.scene.read import read_scene
from scene_builders import empty_scene, image, material, node, place, quad, with_nodes

WIDTH, HEIGHT = 64, 32


@pytest.fixture
def scene():
    made = empty_scene()
    made.world = bpy.data.worlds.new("sky")
    return made


def background(scene, color=(1, 1, 1, 1), strength=1.0):
    tree = with_nodes(scene.world)
    shader = node(tree, "ShaderNodeBackground", {"Color": color, "Strength": strength})
    node(tree, "ShaderNodeOutputWorld", {"Surface": shader.outputs[0]})
    return tree, shader


def environment(scene, pixels, rotation=(0, 0, 0), kind="POINT"):
    tree, shader = background(scene, strength=2.0)
    coordinates = node(tree, "ShaderNodeTexCoord")
    mapping = node(
        tree, "ShaderNodeMapping", {"Vector": coordinates.outputs["Generated"], "Rotation": rotation}, vector_type=kind
    )
    shown = node(tree, "ShaderNodeTexEnvironment", {"Vector": mapping.outputs[0]}, image=image("hdri", pixels))
    tree.links.new(shown.outputs[0], shader.inputs["Color"])
    return shown


def gradient():
    """A smooth picture without symmetry, (HEIGHT, WIDTH, 4)."""
    x, y, z = np.moveaxis(panorama_directions(WIDTH, HEIGHT), -1, 0)
    return np.stack([1 + 0.8 * x, 1 + 0.6 * y + 0.3 * x * z, 1 + 0.9 * z, np.ones_like(x)], axis=-1).astype(np.float32)


def world_seen(scene, width=WIDTH, height=HEIGHT):
    return render_panoramas(scene, np.zeros((1, 3)), width, height, 16)[0]


def test_no_world_is_black(scene):
    scene.world = None
    world = read_scene(scene).world
    assert world.color == (0, 0, 0) and world.map is None


def test_world_without_nodes(scene):
    if bpy.app.version >= (5, 0):
        pytest.skip("every world has nodes in 5.x")
    scene.world.use_nodes = False
    scene.world.color = (0.1, 0.2, 0.3)
    assert read_scene(scene).world.color == pytest.approx((0.1, 0.2, 0.3))


def test_constant_colour_times_strength(scene):
    background(scene, (0.2, 0.4, 0.6, 1), 2.5)
    world = read_scene(scene).world
    assert world.color == pytest.approx((0.5, 1.0, 1.5)) and world.map is None


def test_one_bright_pixel_lies_where_cycles_shows_it(scene):
    pixels = np.zeros((HEIGHT, WIDTH, 4), np.float32)
    pixels[21, 9] = [3, 2, 1, 1]
    environment(scene, pixels).interpolation = "Closest"
    world = read_scene(scene).world
    assert np.array_equal(np.argwhere(world.map[..., 0] > 1), [[21, 9]])
    seen = world_seen(scene)
    assert np.array_equal(np.argwhere(seen[..., 0] > 1), [[21, 9]])
    assert seen[21, 9] == pytest.approx((6, 4, 2))


def test_panoramas_look_where_the_layout_says(scene):
    with_nodes(scene.world)
    for direction, color in (((5, 0, 0), (1, 0, 0, 1)), ((0, 5, 0), (0, 1, 0, 1)), ((0, 0, 5), (0, 0, 1, 1))):
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.5, location=np.add(direction, (10, 20, 30)))
        bpy.context.object.data.materials.append(material("m", "ShaderNodeEmission", {"Color": color}))
    seen = render_panoramas(scene, [(10, 20, 30)], WIDTH, HEIGHT, 16)[0]
    weights = panorama_solid_angles(WIDTH, HEIGHT)[..., None] * panorama_directions(WIDTH, HEIGHT)
    for channel in range(3):
        mean = (weights * seen[..., channel : channel + 1]).sum(axis=(0, 1))
        assert np.allclose(mean / np.linalg.norm(mean), np.eye(3)[channel], atol=0.01)


@pytest.mark.parametrize(
    "rotation",
    [*(pytest.param(some, marks=pytest.mark.any_version) for some in ((0, 0, 0), (0, 0, 1.234))), (0.4, -0.7, 2.0)],
)
@pytest.mark.parametrize("kind", ["POINT", "TEXTURE"])
def test_rotated_environments(scene, rotation, kind):
    environment(scene, gradient(), rotation, kind)
    read, seen = read_scene(scene).world.map, world_seen(scene)
    # Cycles interpolates across the picture's upper and lower edge, which gives the poles another colour.
    assert (np.abs(read - seen).max(axis=-1) < 0.02).mean() > 0.93
    assert np.allclose(panorama_irradiance(read, np.eye(3)), panorama_irradiance(seen, np.eye(3)), rtol=0.005)


def test_other_trees_are_rendered(scene):
    tree, shader = background(scene)
    coordinates = node(tree, "ShaderNodeTexCoord")
    node_up = node(tree, "ShaderNodeSeparateXYZ", {"Vector": coordinates.outputs["Generated"]})
    positive = node(tree, "ShaderNodeMath", {"Value": node_up.outputs["Z"], "Value_001": 0.0}, operation="MAXIMUM")
    tree.links.new(positive.outputs[0], shader.inputs["Strength"])
    before = {name: len(getattr(bpy.data, name)) for name in ("scenes", "worlds", "objects", "cameras", "images")}
    world = read_scene(scene).world
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    height, width = world.map.shape[:2]
    expected = np.maximum(panorama_directions(width, height)[..., 2], 0)
    assert np.allclose(world.map[..., 0], expected, atol=0.01)
    # Radiance z over the upper hemisphere: irradiance upwards is ∫ z² dω = 2π/3.
    assert panorama_irradiance(world.map, np.array([[0, 0, 1.0]]))[0, 0] == pytest.approx(2 * math.pi / 3, rel=1e-3)


def test_sky_texture_keeps_its_sun(scene):
    tree, shader = background(scene, strength=0.1)
    sky = node(tree, "ShaderNodeTexSky", sun_elevation=0.7, sun_rotation=0.3)
    tree.links.new(sky.outputs[0], shader.inputs["Color"])
    first, second = (read_scene(scene).world.map for _ in range(2))
    assert np.array_equal(first, second)
    brightest = np.unravel_index(first[..., 1].argmax(), first.shape[:2])
    assert panorama_directions(*first.shape[1::-1])[brightest][2] == pytest.approx(math.sin(0.7), abs=0.03)
    # Cycles finds the sun by importance: what a white floor sends up is its irradiance over π.
    floor = quad("floor")
    floor.materials.append(material("white", inputs={"Color": (1, 1, 1, 1)}))
    place(floor, scale=(100, 100, 1))
    sent_up = render_panoramas(scene, [(0, 0, 0.01)], 16, 8, 1024, bounces=0)[0, 0].mean(axis=0)
    assert panorama_irradiance(first, np.array([[0, 0, 1.0]]))[0] == pytest.approx(math.pi * sent_up, rel=0.03)


def test_light_path_and_camera_visibility_are_those_of_diffuse_rays(scene):
    tree, shader = background(scene)
    path = node(tree, "ShaderNodeLightPath")
    seen = node(tree, "ShaderNodeBackground", {"Color": (9, 0, 0, 1)})
    mixed = node(
        tree,
        "ShaderNodeMixShader",
        {"Fac": path.outputs["Is Camera Ray"], "Shader": shader.outputs[0], "Shader_001": seen.outputs[0]},
    )
    tree.links.new(mixed.outputs[0], tree.nodes["World Output"].inputs["Surface"])
    scene.world.cycles_visibility.camera = False
    assert np.allclose(read_scene(scene).world.map, 1, atol=1e-4)
    before = {(link.from_socket.path_from_id(), link.to_socket.path_from_id()) for link in tree.links}
    assert np.allclose(render_panoramas(scene, [(0, 0, 0)], 8, 4, 1), 1, atol=1e-4)
    assert {(link.from_socket.path_from_id(), link.to_socket.path_from_id()) for link in tree.links} == before
    assert not scene.world.cycles_visibility.camera
    scene.world.cycles_visibility.diffuse = False
    assert read_scene(scene).world.map is None


def test_reference_radiance_of_a_furnace_and_restored_settings(scene):
    background(scene, (0, 0, 0, 1))
    bpy.ops.mesh.primitive_cube_add(size=2)
    made = bpy.data.materials.new("glow")
    tree = with_nodes(made)
    half = node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.5, 0.5, 0.5, 1)})
    glow = node(tree, "ShaderNodeEmission", {"Strength": 1.0})
    both = node(tree, "ShaderNodeAddShader", {"Shader": half.outputs[0], "Shader_001": glow.outputs[0]})
    node(tree, "ShaderNodeOutputMaterial", {"Surface": both.outputs[0]})
    bpy.context.object.data.materials.append(made)
    hidden = place(bpy.data.lights.new("off", "POINT"), "off", visible_camera=True, location=(0, 0, 0.5))
    hidden.data.energy = 0
    scene.cycles.samples, scene.render.filepath, engine = 7, "//mine", scene.render.engine
    panoramas = render_panoramas(scene, [(0, 0, 0), (0.5, 0.5, 0.5)], 16, 8, 64)
    assert panoramas.shape == (2, 8, 16, 3)
    assert np.allclose(panoramas.mean(axis=(1, 2)), 2.0, rtol=0.01)  # emission / (1 − albedo)
    assert scene.cycles.samples == 7 and scene.render.filepath == "//mine" and scene.render.engine == engine
    assert hidden.visible_camera and scene.camera is None and len(bpy.data.scenes) == 1


def test_lights_are_not_seen_but_what_they_light_is(scene):
    background(scene, (0, 0, 0, 1))
    lamp = bpy.data.lights.new("lamp", "POINT")
    lamp.energy, lamp.shadow_soft_size = 100, 0.5
    place(lamp, location=(0, 0, 3))
    assert render_panoramas(scene, np.zeros((1, 3)), 16, 8, 16).max() == 0
    u, v = panorama_coordinates(np.array([0, 0, 1.0]))
    assert (u, v) == (0.5, 1.0)


def test_renders_know_what_collections_hide_at_another_frame(scene):
    """A glowing sheet over the place, an instance of a collection, which is hidden from frame 10 on."""
    library = bpy.data.collections.new("library")
    sheet = place(quad(), collection=library, location=(0, 0, 1), scale=(9, 9, 1))
    sheet.data.materials.append(material("glow", "ShaderNodeEmission", {"Strength": 2.0}))
    for frame, hidden in ((1, False), (10, True)):
        sheet.hide_render = hidden
        sheet.keyframe_insert("hide_render", frame=frame)
    place(None, instance_type="COLLECTION", instance_collection=library)
    background(scene, strength=0.0)
    scene.frame_set(1)
    seen, gone = (render_panoramas(scene, np.zeros((1, 3)), 16, 8, 1, frame=frame)[0] for frame in (1, 10))
    assert seen[-1].min() > 0.5 and gone.max() == 0 and scene.frame_current == 1
