# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases that only a real .blend can be: what is wrong, far, tiny or numerous in it, from reading to light."""

from dataclasses import replace

import bpy
import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_irradiance
from gridlight.formats.probe_metadata import scene_hash
from gridlight.scene.read import read_scene
from gridlight.tests import scenes
from gridlight.tests.command_line import last_json
from hard_room import SIX, difference, irradiance, room, run, textured, volume
from mathutils import Matrix

# Places and units
# --------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [1e5, 1e6])
def test_the_reference_is_right_far_from_the_origin(distance):
    """Cycles itself is wrong there; its panoramas must not be."""
    from gridlight.scene.cycles_reference import render_panoramas

    at = np.array([[1.75, 1.75, 1.25], [0.5, 0.5, 0.5]])
    before = {item.session_uid for item in bpy.data.objects}
    near, far = (
        np.stack([panorama_irradiance(image, SIX) for image in render_panoramas(room(o), at + o, 32, 16, 16)])
        for o in (np.zeros(3), np.array([distance, -distance, distance]))
    )
    assert difference(far, near) < 0.01
    assert not any(item.name.startswith("Gridlight") for item in bpy.data.objects if item.session_uid not in before)


def test_settings_that_only_change_pictures_change_nothing():
    scene = room()
    expected = scene_hash(read_scene(scene))
    scene.unit_settings.system = "IMPERIAL"
    scene.unit_settings.scale_length = 0.01
    scene.cycles.film_exposure = 7.0
    scene.view_settings.exposure = 3.0
    scene.view_settings.gamma = 2.0
    scene.render.film_transparent = True
    scene.render.resolution_percentage = 3
    scene.cycles.samples = 1
    scene.cycles.max_bounces = 0
    scene.render.use_simplify = False
    assert scene_hash(read_scene(scene)) == expected


def test_film_exposure_does_not_reach_the_reference():
    from gridlight.scene.cycles_reference import render_panoramas

    scene = room()
    plain = render_panoramas(scene, [[1.75, 1.75, 1.25]], 16, 8, 4)
    scene.cycles.film_exposure = 7.0
    scene.view_settings.exposure = 3.0
    scene.unit_settings.scale_length = 0.01
    np.testing.assert_array_equal(render_panoramas(scene, [[1.75, 1.75, 1.25]], 16, 8, 4), plain)


# Geometry
# --------------------------------------------------------------------------------------------------------------------


def test_broken_meshes_beside_good_ones(gpu_context):
    """Vertices that are not finite, faces without area, loose parts, an empty mesh, a flattened object: the light of
    the room without them, and each of the first two named."""
    expected = irradiance(run(read_scene(room()), volume()), volume().positions())
    scene = room()
    grey = scenes.diffuse((0.5, 0.5, 0.5))
    nan, inf = float("nan"), float("inf")
    scenes.add_mesh(
        scene, "Not a number", [(nan, 0, 0), (1, 1, 1), (1, 0, 1), (inf, 1, 0)], [(0, 1, 2), (1, 2, 3)], grey
    )
    scenes.add_mesh(scene, "Needle", [(0.1, 0.1, 0.1), (2, 2, 2), (1.05, 1.05, 1.05)], [(0, 1, 2)], grey)
    scenes.add_mesh(scene, "Loose", [(1, 1, 1), (1.5, 1, 1)], [], grey)
    scenes.add_mesh(scene, "Empty", [], [], grey)
    flat = scenes.add_box(scene, "Flattened", (0.4, 0.4, 0.4), (0.41, 0.41, 0.41), grey)
    flat.scale = (0.0, 0.0, 0.0)
    bpy.context.view_layer.update()
    snapshot = read_scene(scene)
    for name in ("Not a number", "Needle"):
        assert any(name in warning for warning in snapshot.warnings), snapshot.warnings
    result = run(snapshot, volume())
    np.testing.assert_allclose(irradiance(result, volume().positions()), expected, rtol=1e-3, atol=1e-4)


def test_flipped_normals_of_a_mesh(gpu_context):
    """Light in the room, away from the block: a probe inside a solid turned inside out cannot know where it is."""
    points = np.random.default_rng(0).uniform((0.3, 0.3, 1.2), (2.2, 1.0, 2.2), (30, 3))
    expected = irradiance(run(read_scene(room()), volume()), points)
    scene = room()
    for item in scene.objects:
        if item.type == "MESH":
            item.data.flip_normals()
    assert difference(irradiance(run(read_scene(scene), volume()), points), expected) < 1e-2


def add_dust(scene, count):
    """``count`` objects of one mesh of a tenth of a millimetre."""
    mesh = bpy.data.meshes.new("Grain")
    mesh.from_pydata(
        [(0, 0, 0), (1e-4, 0, 0), (0, 1e-4, 0), (0, 0, 1e-4)], [], [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    )
    mesh.materials.append(scenes.diffuse((0.5, 0.5, 0.5)))
    places = np.random.default_rng(1).uniform(0.1, 2.4, (count, 3))
    for place in places:
        item = bpy.data.objects.new("Grain", mesh)
        item.location = place
        scene.collection.objects.link(item)
    bpy.context.view_layer.update()


@pytest.mark.any_version
@pytest.mark.parametrize("count", [1_000, pytest.param(100_000, marks=pytest.mark.nightly)])
def test_many_tiny_objects(gpu_context, count):
    expected = irradiance(run(read_scene(room()), volume()), volume().positions())
    scene = room()
    add_dust(scene, count)
    snapshot = read_scene(scene)
    assert len(snapshot.object_names) == count + 7
    assert difference(irradiance(run(snapshot, volume()), volume().positions()), expected) < 1e-2


# Light
# --------------------------------------------------------------------------------------------------------------------


@pytest.mark.any_version
def test_many_lamps(gpu_context):
    """Lamps in one place, with their share of the power each; hundreds are tested where no scene is read."""
    count = 40
    grid = Grid.from_bounds([0.5] * 3, [2.0] * 3, (2, 1, 1))
    expected = irradiance(run(read_scene(room()), grid, face=4, bounces=0), grid.positions())
    scene = room(lamp=False)
    data = bpy.data.lights.new("Small", "POINT")
    data.energy, data.shadow_soft_size = 50.0 / count, 0.0
    for _ in range(count):
        item = bpy.data.objects.new("Small", data)
        item.location = 1.75, 0.75, 2.0
        scene.collection.objects.link(item)
    bpy.context.view_layer.update()
    snapshot = read_scene(scene)
    assert len(snapshot.lights) == count
    assert difference(irradiance(run(snapshot, grid, face=4, bounces=0), grid.positions()), expected) < 2e-3


@pytest.mark.any_version
def test_negative_emission_is_that_of_cycles(gpu_context):
    """A panel of negative strength in a lit room takes light away, in Cycles and here."""
    from gridlight.scene.cycles_reference import render_panoramas

    scene = room()
    scenes.add_plane(
        scene, "Panel", (1.25, 0.5, 2.25), (1.0, 0, 0), (0, 0.375, 0), scenes.emitter((1.0, 0.5, 0.0), -0.4)
    )
    bpy.context.view_layer.update()
    snapshot = read_scene(scene)
    assert any("negative" in warning and "Emitter" in warning for warning in snapshot.warnings)
    at = volume().positions()[[1, 22, 42, 63]]
    images = render_panoramas(scene, at, 64, 32, 64)
    truth = np.stack([panorama_irradiance(image, SIX) for image in images])
    assert difference(irradiance(run(snapshot, volume(), face=16), at), truth) < 0.08


# Textures
# --------------------------------------------------------------------------------------------------------------------


def textured_room(image):
    scene = room(material=textured(image))
    for item in scene.objects:
        if item.type == "MESH":
            item.data.uv_layers.new(name="UVMap")
    bpy.context.view_layer.update()
    return read_scene(scene)


@pytest.mark.parametrize(
    "size",
    [
        pytest.param((1, 1), marks=pytest.mark.any_version),
        pytest.param((1, 777), marks=pytest.mark.any_version),
        (4096, 4096),
        pytest.param((8192, 8192), marks=pytest.mark.nightly),
    ],
)
def test_textures_of_every_size(gpu_context, size):
    """One colour, whatever its number of pixels."""
    image = bpy.data.images.new("Flat", *size)
    image.colorspace_settings.name = "Non-Color"
    image.generated_color = (0.6, 0.6, 0.6, 1.0)
    snapshot = textured_room(image)
    bpy.data.images.remove(image)
    assert max(snapshot.images[0].pixels.shape[:2]) <= 1024
    np.testing.assert_allclose(snapshot.images[0].pixels[..., :3], 0.6, atol=2e-3)
    grid = Grid.from_bounds([0.5] * 3, [2.0] * 3, (2, 2, 2))
    grey = read_scene(room(material=scenes.diffuse((0.6, 0.6, 0.6))))
    expected = irradiance(run(grey, grid), grid.positions())
    assert difference(irradiance(run(snapshot, grid), grid.positions()), expected) < 1e-2


def test_colour_data_and_other_spaces():
    """The same bytes: sRGB is decoded, Non-Color is not."""
    values = {}
    for space in ("sRGB", "Non-Color"):
        image = bpy.data.images.new(space, 4, 4)
        image.colorspace_settings.name = space
        image.pixels.foreach_set(np.tile(np.array([0.5, 0.5, 0.5, 1.0], np.float32), 16))
        values[space] = float(textured_room(image).images[0].pixels[0, 0, 0])
    assert values["Non-Color"] == pytest.approx(0.5, abs=3e-3)
    assert values["sRGB"] == pytest.approx(0.214, abs=3e-3)


def test_a_missing_texture_is_named_and_the_room_is_lit(gpu_context, tmp_path):
    image = bpy.data.images.new("gone.png", 4, 4)
    image.source = "FILE"
    image.filepath = str(tmp_path / "gone.png")
    snapshot = textured_room(image)
    assert any("gone.png" in warning for warning in snapshot.warnings)
    grid = Grid.from_bounds([0.5] * 3, [2.0] * 3, (2, 2, 2))
    found = irradiance(run(snapshot, grid), grid.positions())
    assert np.isfinite(found).all() and found.mean() > 0
    assert found[..., 0].mean() > found[..., 1].mean()  # the socket's own magenta


# The whole command
# --------------------------------------------------------------------------------------------------------------------


@pytest.mark.any_version
def test_deringing_is_done_where_it_is_asked_for_and_said(run_gridlight, tmp_path):
    """A dark room with one small bright window of light rings; asked to, the bake takes that away."""
    scene = scenes.new_scene("Spot")
    scenes.add_box(scene, "Room", (0, 0, 0), (3, 3, 3), scenes.diffuse((0.02, 0.02, 0.02)), inward=True)
    scenes.add_light(scene, "SPOT", (1.5, 1.5, 2.9), energy=500.0, spot_size=0.4, spot_blend=0.0, shadow_soft_size=0.0)
    scenes.save(scene, tmp_path / "spot.blend")
    options = ("--min", "0.5,0.5,0.5", "--max", "2.5,2.5,2.5", "--resolution", "3,3,3", "--no-pictures", "--quiet")
    summaries = []
    for name, extra in (("plain", ()), ("deringed", ("--deringing",))):
        done = run_gridlight("bake", tmp_path / "spot.blend", "-o", tmp_path / name, *options, *extra)
        assert done.returncode == 0, done.stderr
        summaries.append(last_json(done))
    plain, deringed = summaries
    assert plain["ringing"]["negative"] > 0 and plain["ringing"]["lowest"] < -0.01
    assert plain["settings"]["deringing"] is False and deringed["settings"]["deringing"] is True
    assert deringed["ringing"]["negative"] == 0
    told = (tmp_path / "deringed" / "report.html").read_text(encoding="utf-8")
    assert "deringing:" in told
    done = run_gridlight("info", tmp_path / "plain" / "probes.exr")
    assert "below zero" in done.stdout
    assert "below zero" not in run_gridlight("info", tmp_path / "deringed" / "probes.exr").stdout


def test_a_sheared_volume_of_the_file(gpu_context):
    """A volume whose parent shears and mirrors it: its probes stand where Blender shows the box."""
    from gridlight.scene.volumes import create_volume

    scene = room()
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.scale = (-1.5, 0.8, 1.0)
    parent.location = 1.25, 1.25, 1.25
    item = create_volume(scene, "Sheared", np.eye(4), (3, 3, 3))
    item.parent = parent
    item.matrix_basis = Matrix.Rotation(0.6, 4, "Z") @ Matrix.Scale(0.6, 4)
    bpy.context.view_layer.update()
    snapshot = read_scene(scene)
    found = snapshot.volumes[0]
    np.testing.assert_allclose(found.matrix, np.array(item.matrix_world), atol=1e-6)
    assert np.linalg.det(found.matrix[:3, :3]) < 0
    result = run(snapshot, Grid(found.matrix, found.resolution))
    straight = irradiance(run(snapshot, volume()), np.array([[1.5, 1.25, 1.5], [1.0, 1.0, 1.6]]))
    assert difference(irradiance(result, np.array([[1.5, 1.25, 1.5], [1.0, 1.0, 1.6]])), straight) < 0.15


def test_a_lamp_with_a_scale_of_zero_and_nan_transform(gpu_context):
    scene = room()
    flat = scenes.add_light(scene, "AREA", (1, 1, 2.4), energy=10.0)
    flat.scale = (0.0, 1.0, 1.0)
    lost = scenes.add_light(scene, "POINT", (float("nan"), 0, 0), energy=10.0)
    bpy.context.view_layer.update()
    snapshot = read_scene(scene)
    assert any(lost.name in warning for warning in snapshot.warnings)
    result = run(replace(snapshot, warnings=[]), volume())
    assert np.isfinite(result.field.coefficients).all()
