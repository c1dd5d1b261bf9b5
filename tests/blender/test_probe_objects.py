# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes as Empties: where they stand, what replaces them, and that nothing else is touched."""

import time

import bpy
import gridlight
import numpy as np
import pytest
from gridlight.core.conventions import ACTIVE, CULLED, INVALID
from gridlight.core.grid import Grid
from gridlight.scene import probe_objects
from gridlight.scene.volumes import create_volume


@pytest.fixture
def scene():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


@pytest.fixture
def registered():
    gridlight.register()
    yield
    gridlight.unregister()


def grid_of(resolution, name="Hall", low=(0, 0, 0), high=(3, 2, 1)):
    return Grid.from_bounds(low, high, resolution, name)


def probes_in(scene, volume="Hall"):
    found = [item for item in scene.objects if item.get(probe_objects.VOLUME_PROPERTY) == volume]
    return {item[probe_objects.INDEX_PROPERTY]: item for item in found}


def test_active_probes_stand_on_their_nodes(scene):
    grid = grid_of((4, 3, 2))
    state = np.full(24, ACTIVE)
    state[[3, 7]] = CULLED, INVALID
    target = probe_objects.place_probes(scene, grid, state)
    assert target.name == "Gridlight Probes" and len(target.objects) == 22
    placed = probes_in(scene)
    assert sorted(placed) == sorted(set(range(24)) - {3, 7})
    for index, probe in placed.items():
        assert np.allclose(probe.location, grid.positions()[index], atol=1e-6)
        assert probe.type == "EMPTY" and probe.empty_display_type == "SPHERE"
    assert placed[5].name == "Hall 05"


def test_placing_again_replaces(scene):
    grid = grid_of((4, 3, 2))
    probe_objects.place_probes(scene, grid, np.full(24, ACTIVE))
    before = len(bpy.data.objects)
    state = np.where(np.arange(24) < 10, ACTIVE, CULLED)
    probe_objects.place_probes(scene, grid, state)
    assert len(probes_in(scene)) == 10
    assert len(bpy.data.objects) == before - 14
    assert [item.name for item in bpy.data.collections] == ["Gridlight Probes"]
    assert "Hall 00" in bpy.data.objects  # not "Hall 00.001"


def test_several_volumes_get_collections_of_their_own(scene):
    probe_objects.place_probes(scene, grid_of((2, 2, 2), "Hall"), np.full(8, ACTIVE))
    probe_objects.place_probes(scene, grid_of((3, 2, 2), "Attic", high=(1, 1, 1)), np.full(12, ACTIVE))
    root = bpy.data.collections["Gridlight Probes"]
    assert {child.name: len(child.objects) for child in root.children} == {"Hall": 8, "Attic": 12}
    assert not root.objects
    probe_objects.place_probes(scene, grid_of((2, 2, 2), "Hall"), np.full(8, ACTIVE))
    assert {child.name: len(child.objects) for child in root.children} == {"Hall": 8, "Attic": 12}


def test_clearing_leaves_what_is_not_a_probe(scene):
    target = probe_objects.place_probes(scene, grid_of((2, 2, 2)), np.full(8, ACTIVE))
    guest = bpy.data.objects.new("Somebody's lamp", None)
    target.objects.link(guest)
    assert probe_objects.clear_probes(scene) == 8
    assert guest.name in scene.objects and probes_in(scene) == {}
    target.objects.unlink(guest)
    assert probe_objects.clear_probes(scene) == 0
    assert not bpy.data.collections


def test_another_scene_keeps_its_probes(scene):
    probe_objects.place_probes(scene, grid_of((2, 2, 2)), np.full(8, ACTIVE))
    other = bpy.data.scenes.new("Other")
    probe_objects.place_probes(other, grid_of((3, 2, 2)), np.full(12, ACTIVE))
    assert (len(probes_in(scene)), len(probes_in(other))) == (8, 12)
    probe_objects.clear_probes(other)
    assert len(probes_in(scene)) == 8


def test_long_and_non_ascii_volume_names(scene):
    name = "Größenübersicht " * 5
    probe_objects.place_probes(scene, grid_of((2, 2, 2), name), np.full(8, ACTIVE))
    assert len({item.name for item in probes_in(scene, name).values()}) == 8
    assert all(item.name.endswith(f" {index}") for index, item in probes_in(scene, name).items())


def test_as_many_objects_as_there_may_be_in_two_seconds(scene):
    grid = grid_of((20, 10, 10))
    assert grid.count == probe_objects.OBJECT_LIMIT
    for _ in range(2):  # the second time replaces the first
        started = time.process_time()
        probe_objects.place_probes(scene, grid, np.full(grid.count, ACTIVE))
        assert time.process_time() - started < 2
    assert len(probes_in(scene)) == grid.count


def test_operator_places_culled_probes_and_forgets_lost_volumes(scene, registered):
    # A floor below a tall box: only the two lowest layers of nodes touch cells that hold surface.
    bpy.ops.mesh.primitive_plane_add(size=1.8)
    create_volume(scene, "Tall", np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 2, 1.5], [0, 0, 0, 1.0]]), (2, 2, 5))
    assert bpy.ops.gridlight.place_probes() == {"FINISHED"}
    assert sorted(probes_in(scene, "Tall")) == list(range(8))
    scene.objects["Tall"].name = "Renamed"
    assert bpy.ops.gridlight.place_probes() == {"FINISHED"}
    assert probes_in(scene, "Tall") == {} and len(probes_in(scene, "Renamed")) == 8
    assert bpy.ops.gridlight.clear_probes() == {"FINISHED"}
    assert probes_in(scene, "Renamed") == {}


def test_operator_takes_the_active_volume_only(scene, registered):
    bpy.ops.mesh.primitive_cube_add(size=1)
    one = create_volume(scene, "One", np.eye(4), (2, 2, 2))
    two = create_volume(scene, "Two", np.eye(4), (2, 2, 2))
    bpy.context.view_layer.objects.active = two
    bpy.ops.gridlight.place_probes()
    assert probe_objects.placed_count(scene, two) == 8 and probe_objects.placed_count(scene, one) is None
    bpy.context.view_layer.objects.active = None
    bpy.ops.gridlight.place_probes()
    assert probe_objects.placed_count(scene, one) == 8


def test_operator_says_what_is_missing(scene, registered):
    with pytest.raises(RuntimeError, match="Add a probe volume first"):
        bpy.ops.gridlight.place_probes()
    create_volume(scene, "One", np.eye(4), (2, 2, 2))
    with pytest.raises(RuntimeError, match="no surface"):
        bpy.ops.gridlight.place_probes()
