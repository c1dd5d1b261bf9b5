# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and properties without a window: what a script sees. Bakes and edits of probes: ``test_interface_*.py``."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from gridlight.core.settings import BakeSettings
from gridlight.formats import probe_file
from gridlight.scene.field_storage import load_field
from gridlight.scene.read import read_scene
from gridlight.scene.volumes import create_volume


def test_settings_are_the_bakes_own_by_default(scene):
    assert scene.gridlight.bake_settings() == BakeSettings()
    assert scene.gridlight.quality == "GOOD"


def test_presets_and_single_settings_agree(scene):
    settings = scene.gridlight
    settings.quality = "DRAFT"
    assert settings.face == 8 and settings.quality == "DRAFT"
    settings.face = 20
    assert settings.quality == "CUSTOM"
    settings.quality = "GOOD"
    assert settings.face == 16
    settings.quality = "CUSTOM"
    assert settings.quality == "CUSTOM" and settings.face == 16


def test_spacing_chooses_counts_and_remembers_what_was_typed(scene):
    volume = create_volume(scene, "Box", np.diag([2.0, 1.0, 0.5, 1.0]), (2, 2, 2))
    bpy.context.view_layer.update()
    grid = volume.gridlight_grid
    grid.spacing = 0.45
    assert tuple(grid.resolution) == (10, 5, 3)
    assert grid.spacing == pytest.approx(0.45)
    grid.resolution = (5, 2, 2)
    assert grid.spacing == pytest.approx(2.0)  # the largest of the three


def test_light_roles_are_what_a_bake_reads(scene):
    bpy.ops.object.light_add(type="POINT")
    lamp = bpy.context.object
    power = read_scene(scene).lights[0].color[0]
    lamp.gridlight_light.role, lamp.gridlight_light.group = "DYNAMIC", "CEILING_2"
    lamp.gridlight_light.intensity = 0.5
    light = read_scene(scene).lights[0]
    assert light.dynamic and light.group == "ceiling2"
    assert light.color[0] == pytest.approx(0.5 * power)


def test_add_volume_goes_around_scene_or_selection(scene):
    bpy.ops.mesh.primitive_cube_add(size=2.0)
    bpy.ops.mesh.primitive_cube_add(size=2.0, location=(10, 0, 0))
    assert bpy.ops.gridlight.add_volume(fit="SELECTION") == {"FINISHED"}
    volume = bpy.context.object
    assert np.allclose(volume.location, (10, 0, 0), atol=1e-5)
    assert 1.0 < volume.scale[0] < 1.5
    bpy.ops.gridlight.fit_volume(fit="SCENE")
    assert np.allclose(volume.location, (5, 0, 0), atol=1e-5) and volume.scale[0] > 6.0


def test_fit_keeps_rotation_and_spacing(scene):
    bpy.ops.mesh.primitive_cube_add(size=2.0, rotation=(0, 0, 0.6))
    bpy.context.view_layer.update()
    turned = np.eye(4)
    turned[:2, :2] = [[np.cos(0.6), -np.sin(0.6)], [np.sin(0.6), np.cos(0.6)]]
    volume = create_volume(scene, "Turned", turned * [0.5, 0.5, 0.5, 1], (3, 3, 3))
    bpy.context.view_layer.objects.active = volume
    bpy.context.view_layer.update()
    bpy.ops.gridlight.fit_volume(fit="SCENE")
    assert volume.rotation_euler[2] == pytest.approx(0.6, abs=1e-5)
    assert np.allclose(volume.scale, volume.scale[0], rtol=1e-4) and 1.0 < volume.scale[0] < 1.2
    assert tuple(volume.gridlight_grid.resolution) == (5, 5, 5)


def test_operators_say_what_is_missing(scene):
    assert not bpy.ops.gridlight.bake.poll()
    assert not bpy.ops.gridlight.export.poll()
    with pytest.raises(RuntimeError, match="nothing with a surface"):
        bpy.ops.gridlight.add_volume(fit="SELECTION")
    with pytest.raises(
        RuntimeError, match=r"nothing in the scene has a surface that renders show; add a mesh first\s*$"
    ):
        bpy.ops.gridlight.add_volume()


@pytest.mark.parametrize("target", ["exr", "json"])
def test_export_writes_what_is_stored(room, gpu_context, tmp_path, target):
    bpy.ops.gridlight.bake()
    settings = bpy.context.scene.gridlight.export
    settings.target, settings.directory = target, str(tmp_path / "out")
    assert bpy.ops.gridlight.export() == {"FINISHED"}
    files = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert any(name.startswith("probes.") for name in files)
    if target == "exr":
        written = probe_file.read(tmp_path / "out" / "probes.exr")
        assert np.array_equal(written.coefficients, load_field(room).coefficients)
        settings.directory = str(tmp_path / "out" / "probes.exr" / "deeper")
        with pytest.raises(RuntimeError, match=r"cannot write to the folder .*; name another one\s*$"):
            bpy.ops.gridlight.export()


def test_report_of_what_is_stored(room, gpu_context):
    bpy.ops.gridlight.bake()
    assert bpy.ops.gridlight.report() == {"FINISHED"}
    assert "Room" in (Path(bpy.app.tempdir) / "gridlight-report.html").read_text()


def test_gallery_is_a_scene_of_its_own(scene):
    bpy.ops.mesh.primitive_cube_add()
    before = {item.name: tuple(item.location) for item in scene.objects}
    assert bpy.ops.gridlight.add_gallery() == {"FINISHED"}
    assert {item.name: tuple(item.location) for item in scene.objects} == before
    gallery = bpy.data.scenes["Gridlight Gallery"]
    groups = {item.gridlight_light.group for item in gallery.objects}
    assert groups == {"NONE", "CEILING_1", "CEILING_2", "WALL", "DYNAMIC"}


def test_a_probe_file_comes_back_as_a_volume_with_its_light(room, tmp_path):
    assert bpy.ops.gridlight.bake() == {"FINISHED"}
    baked = load_field(room)
    probe_file.write(tmp_path / "probes.exr", baked)
    assert bpy.ops.gridlight.import_field(filepath=str(tmp_path / "probes.exr")) == {"FINISHED"}
    volume = bpy.context.view_layer.objects.active
    assert volume != room
    field = load_field(volume)
    np.testing.assert_allclose(field.grid.matrix, baked.grid.matrix, atol=1e-6)
    for name in ("coefficients", "state", "offset", "depth", "gradient"):
        np.testing.assert_array_equal(getattr(field, name), getattr(baked, name))


def test_what_is_no_probe_file_adds_nothing(scene, tmp_path):
    (tmp_path / "broken.exr").write_bytes(b"no picture")
    for name in ("broken.exr", "missing.exr"):
        with pytest.raises(RuntimeError, match=name):
            bpy.ops.gridlight.import_field(filepath=str(tmp_path / name))
    assert not scene.objects
