# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators and properties without a window: what a script sees."""

import bpy
import gridlight
import numpy as np
import pytest
from gridlight.core.error_budget import ErrorGoal
from gridlight.core.errors import InputError
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.formats import probe_file
from gridlight.scene import probe_objects
from gridlight.scene.field_storage import (
    has_moved,
    load_field,
    store_field,
    stored_counts,
    stored_details,
    stored_metadata,
    unreadable,
)
from gridlight.scene.volumes import create_volume


@pytest.fixture
def scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    gridlight.register()
    yield bpy.context.scene
    gridlight.unregister()


@pytest.fixture
def room(scene):
    """A closed room with a lamp, and a volume of 3×3×3 in it."""
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.3, 1.0))
    bpy.context.object.data.energy = 100.0
    volume = create_volume(scene, "Room", np.diag([1.6, 1.6, 1.6, 1.0]), (3, 3, 3))
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = volume
    return volume


def probes(volume):
    """The volume's probes in the scene."""
    return [item for item in bpy.context.scene.objects if item.get(probe_objects.VOLUME_PROPERTY) == volume.name]


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
    from gridlight.scene.read import read_scene

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


def test_bake_is_in_the_file_after_saving_and_loading(room, gpu_context, tmp_path):
    assert bpy.ops.gridlight.bake() == {"FINISHED"}
    baked = load_field(room)
    assert baked.coefficients.shape == (27, 9, 3) and baked.coefficients[:, 0].mean() > 0
    path = str(tmp_path / "room.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.open_mainfile(filepath=path)
    again = load_field(bpy.data.objects["Room"])
    for name in ("coefficients", "state", "validity", "offset", "depth", "gradient"):
        assert np.array_equal(getattr(again, name), getattr(baked, name)), name
    assert again.metadata == baked.metadata and again.gradient.any()
    del bpy.data.objects["Room"]["gridlight_field"]["gradient"]  # as it was stored before there were any
    assert not load_field(bpy.data.objects["Room"]).gradient.any()


def test_a_target_error_is_baked_for_and_what_was_reached_is_told(room, gpu_context):
    settings = bpy.context.scene.gridlight
    assert settings.error_goal() is None
    settings.use_error, settings.target_error_percent = True, 20.0
    assert settings.error_goal() == ErrorGoal(0.2)
    assert bpy.ops.gridlight.bake() == {"FINISHED"}
    baked = load_field(room)
    assert baked.metadata["error"]["target"] == 0.2 and baked.metadata["error"]["met"]
    assert baked.bands == baked.metadata["settings"]["bands"] < 3
    assert "error at probes" in stored_details(room)["outcome"]


def test_a_copied_volume_keeps_the_originals_light_apart(room, gpu_context):
    bpy.ops.gridlight.bake()
    copy = room.copy()
    bpy.context.scene.collection.objects.link(copy)
    bpy.context.view_layer.update()
    before = load_field(room).coefficients
    bpy.data.objects["Point"].data.energy = 10.0
    bpy.context.view_layer.objects.active = copy
    bpy.ops.gridlight.bake()
    assert np.array_equal(load_field(room).coefficients, before)
    assert load_field(copy).coefficients.mean() < 0.2 * before.mean()


def test_clear_bake_leaves_nothing(room, gpu_context):
    bpy.ops.gridlight.bake()
    assert len(bpy.data.texts) == 1
    bpy.ops.gridlight.clear_bake()
    assert not bpy.data.texts and load_field(room) is None


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [("gridlight_version", 2, "newer Gridlight"), ("metadata", b"", "damaged"), ("state", "x", "damaged")],
)
def test_light_that_cannot_be_read_is_told_and_baked_over(room, gpu_context, key, value, words):
    """Panels ask at every redraw: a file of a newer Gridlight must not fill the console."""
    grid = Grid(np.diag([1.6, 1.6, 1.6, 1.0]), (3, 3, 3), "Room")
    store_field(room, Field.empty(grid, 3), "known")
    text = room["gridlight_field"]
    del text[key]
    text[key] = value
    assert words in unreadable(room)
    assert stored_metadata(room) is None and stored_counts(room) is None and not stored_details(room)
    assert not has_moved(room)
    with pytest.raises(InputError, match=words):
        load_field(room)
    assert bpy.ops.gridlight.check_bake() == {"FINISHED"}
    with pytest.raises(RuntimeError, match=words):
        bpy.ops.gridlight.report()
    assert bpy.ops.gridlight.bake() == {"FINISHED"}
    assert not unreadable(room) and load_field(room) is not None


def test_deleted_and_moved_probes_are_edits(room):
    scene = bpy.context.scene
    bpy.ops.gridlight.place_probes()
    placed = {item[probe_objects.INDEX_PROPERTY]: item for item in probes(room)}
    assert len(placed) == 27 and probe_objects.read_edits(scene, room) is None
    bpy.data.objects.remove(placed[4])
    placed[13].location.x += 0.3
    placed[14].location.z += 5.0
    for item in (room, bpy.data.objects["Cube"]):
        item.location.y += 7.0  # edits go with the volume
    bpy.context.view_layer.update()
    assert probe_objects.stand_elsewhere(scene, room)
    edits = probe_objects.read_edits(scene, room)
    assert np.flatnonzero(edits.disabled).tolist() == [4]
    assert np.allclose(edits.offset[13], (0.3, 0, 0), atol=1e-5)
    assert np.allclose(edits.offset[14], (0, 0, 0.8), atol=1e-5)  # half a cell
    assert np.flatnonzero(edits.offset.any(axis=1)).tolist() == [13, 14]
    bpy.ops.gridlight.place_probes()  # placing again keeps what was done
    assert not probe_objects.stand_elsewhere(scene, room)
    again = probe_objects.read_edits(scene, room)
    assert np.array_equal(again.disabled, edits.disabled) and np.allclose(again.offset, edits.offset, atol=1e-5)
    bpy.ops.gridlight.reset_probes()
    assert probe_objects.read_edits(scene, room) is None and len(probes(room)) == 27


def test_reset_of_selected_probes_leaves_the_others(room):
    scene = bpy.context.scene
    bpy.ops.gridlight.place_probes()
    placed = {item[probe_objects.INDEX_PROPERTY]: item for item in probes(room)}
    placed[3].location.x += 0.2
    placed[5].location.x += 0.2
    bpy.ops.object.select_all(action="DESELECT")
    placed[5].select_set(True)
    bpy.ops.gridlight.reset_probes(selected=True)
    assert np.flatnonzero(probe_objects.read_edits(scene, room).offset.any(axis=1)).tolist() == [3]


def test_a_bake_respects_edited_probes(room, gpu_context):
    bpy.ops.gridlight.bake()
    free = load_field(room)
    bpy.ops.gridlight.place_probes()
    placed = {item[probe_objects.INDEX_PROPERTY]: item for item in probes(room)}
    bpy.data.objects.remove(placed[4])
    placed[13].location.x += 0.3
    bpy.ops.gridlight.bake()
    edited = load_field(room)
    assert stored_counts(room)["culled"] == 1 and edited.state[4] == 0
    assert np.allclose(edited.offset[13], (0.3, 0, 0), atol=1e-5)
    assert not np.allclose(edited.coefficients[13], free.coefficients[13], rtol=1e-2)
    assert np.allclose(edited.coefficients[0, 0], free.coefficients[0, 0], rtol=0.05)


def test_large_grids_become_points(room):
    room.gridlight_grid.resolution = (20, 20, 8)
    scene = bpy.context.scene
    scene.gridlight.keep_all = True
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=2, size=3)
    grid = Grid(np.diag([1.6, 1.6, 1.6, 1.0]), (20, 20, 8), "Room")
    probe_objects.place_probes(scene, grid, np.ones(grid.count, np.uint8), room)
    assert not probes(room)
    (volume, points), *others = probe_objects.placed_points(scene)
    assert volume == room and points.shape == (3200, 3) and not others
    assert np.allclose(points.min(axis=0), -1.6)
    probe_objects.clear_probes(scene)
    assert not probe_objects.placed_points(scene) and not bpy.data.collections


@pytest.mark.parametrize("target", ["exr", "json"])
def test_export_writes_what_is_stored(room, gpu_context, tmp_path, target):
    bpy.ops.gridlight.bake()
    settings = bpy.context.scene.gridlight.export
    settings.target, settings.directory = target, str(tmp_path / "out")
    assert bpy.ops.gridlight.export() == {"FINISHED"}
    files = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert any(name.startswith("probes.") for name in files)
    if target == "exr":
        from gridlight.formats import probe_file

        written = probe_file.read(tmp_path / "out" / "probes.exr")
        assert np.array_equal(written.coefficients, load_field(room).coefficients)
        settings.directory = str(tmp_path / "out" / "probes.exr" / "deeper")
        with pytest.raises(RuntimeError, match=r"cannot write to the folder .*; name another one\s*$"):
            bpy.ops.gridlight.export()


def test_report_of_what_is_stored(room, gpu_context):
    from pathlib import Path

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


def test_relight_ends_where_a_new_bake_does(room, gpu_context):
    assert not bpy.ops.gridlight.relight.poll()
    bpy.ops.gridlight.bake()
    first = load_field(room).coefficients
    bpy.data.objects["Point"].location.x = -0.7
    assert bpy.ops.gridlight.relight() == {"FINISHED"}
    relit = load_field(room).coefficients
    bpy.ops.gridlight.bake()
    anew = load_field(room).coefficients
    scale = np.abs(anew).max()
    assert np.abs(anew - first).max() > 0.05 * scale
    assert np.abs(relit - anew).max() < 0.01 * scale


def test_relight_with_other_settings_is_a_bake(room, gpu_context):
    bpy.ops.gridlight.bake()
    bpy.context.scene.gridlight.bands = 2
    bpy.ops.gridlight.relight()
    assert load_field(room).bands == 2


def test_a_relight_without_changes_says_so(room, gpu_context):
    """Not that light bounced no times; and what was known of the bake stays."""
    bpy.ops.gridlight.bake()
    iterations = stored_metadata(room)["iterations"]
    bpy.ops.gridlight.relight()
    assert "Nothing had changed" in stored_details(room)["outcome"]
    assert stored_metadata(room)["iterations"] == iterations > 1


@pytest.mark.parametrize("bounces, words", [(0, "did not bounce"), (1, "bounced once"), (3, "bounced 3 times")])
def test_outcomes_say_how_often_light_bounced(room, gpu_context, bounces, words):
    settings = bpy.context.scene.gridlight
    settings.bounces_auto, settings.bounces, settings.face = False, bounces, 4
    bpy.ops.gridlight.bake()
    assert f"light {words}" in stored_details(room)["outcome"]


def test_an_animated_lamp_moved_by_hand_goes_back_and_that_is_said(room, gpu_context):
    """As in a render; light and lamp then agree."""
    lamp = bpy.data.objects["Point"]
    lamp.keyframe_insert("location", frame=1)
    place = lamp.location.copy()
    bpy.ops.gridlight.bake()
    assert not stored_metadata(room)["warnings"]
    baked = load_field(room).coefficients
    lamp.location.x -= 1.0
    bpy.ops.gridlight.relight()
    (warning,) = stored_metadata(room)["warnings"]
    assert "'Point' is animated and was changed by hand" in warning and "keyframe" in warning
    assert lamp.location == place and np.array_equal(load_field(room).coefficients, baked)
    lamp.location.x -= 1.0
    lamp.keyframe_insert("location", frame=1)
    bpy.ops.gridlight.relight()
    assert not stored_metadata(room)["warnings"] and "relit" in stored_details(room)["outcome"]
    assert lamp.location.x == place.x - 1.0
    assert np.abs(load_field(room).coefficients - baked).max() > 0.05 * np.abs(baked).max()


def test_nothing_is_kept_with_another_file(room, gpu_context):
    from gridlight.operators import kept_bakes

    bpy.ops.gridlight.bake()
    uid = room.session_uid
    assert kept_bakes.is_kept(uid) and bpy.ops.gridlight.relight.poll()
    bpy.ops.wm.read_homefile(use_empty=True)
    assert not kept_bakes.is_kept(uid)


def test_parented_and_turned_volumes_are_baked_where_they_stand(room, gpu_context):
    scene = bpy.context.scene
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.rotation_euler.z, parent.location = 0.4, (0.1, 0.0, 0.2)
    room.parent = parent
    room.scale = (0.6, 0.8, 0.5)
    bpy.context.view_layer.update()
    bpy.ops.gridlight.bake()
    assert np.allclose(load_field(room).grid.matrix, np.array(room.matrix_world), atol=1e-6)
    from gridlight.scene.field_storage import has_moved

    assert not has_moved(room)
    parent.rotation_euler.z = 0.5
    bpy.context.view_layer.update()
    assert has_moved(room)


def test_a_volume_whose_animation_overrules_the_hand_is_baked_where_it_then_stands(room, gpu_context):
    parent = bpy.data.objects.new("Rig", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.keyframe_insert("location", frame=1)
    room.parent = parent
    parent.location.x = 0.3
    bpy.context.view_layer.update()
    assert room.matrix_world.translation.x > 0.2
    bpy.ops.gridlight.bake()
    (warning,) = stored_metadata(room)["warnings"]
    assert "'Rig' is animated" in warning
    assert np.allclose(room.matrix_world.translation, 0) and np.allclose(load_field(room).grid.center, 0)


def test_the_command_line_finds_the_same_edits(room):
    scene = bpy.context.scene
    bpy.ops.gridlight.place_probes()
    bpy.data.objects.remove(probes(room)[4])
    grid = Grid(np.diag([1.6, 1.6, 1.6, 1.0]), (3, 3, 3), "Room")
    assert probe_objects.edits_of(scene, grid).disabled.sum() == 1
    assert probe_objects.edits_of(scene, Grid(grid.matrix, (4, 3, 3), "Room")) is None  # --resolution was given
    assert probe_objects.edits_of(scene, Grid(grid.matrix, (3, 3, 3), "fitted volume")) is None


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
