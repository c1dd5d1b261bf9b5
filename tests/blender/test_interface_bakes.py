# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes and relights by their operators, and the light that is stored in the file, without a window."""

from pathlib import Path

import bpy
import numpy as np
import pytest
from gridlight.core.error_budget import ErrorGoal
from gridlight.core.errors import InputError
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.operators import kept_bakes
from gridlight.scene.field_storage import (
    has_moved,
    load_field,
    store_field,
    stored_counts,
    stored_details,
    stored_metadata,
    unreadable,
)


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
    assert bpy.ops.gridlight.report() == {"FINISHED"}
    report = (Path(bpy.app.tempdir) / "gridlight-report.html").read_text()
    assert "Error at probes" in report and "target, met" in report


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
