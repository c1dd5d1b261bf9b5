# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes that users move and delete: edits that placing keeps and bakes obey, without a window."""

import bpy
import numpy as np
from gridlight.core.grid import Grid
from gridlight.scene import probe_objects
from gridlight.scene.field_storage import load_field, stored_counts


def probes(volume):
    """The volume's probes in the scene."""
    return [item for item in bpy.context.scene.objects if item.get(probe_objects.VOLUME_PROPERTY) == volume.name]


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


def test_the_command_line_finds_the_same_edits(room):
    scene = bpy.context.scene
    bpy.ops.gridlight.place_probes()
    bpy.data.objects.remove(probes(room)[4])
    grid = Grid(np.diag([1.6, 1.6, 1.6, 1.0]), (3, 3, 3), "Room")
    assert probe_objects.edits_of(scene, grid).disabled.sum() == 1
    assert probe_objects.edits_of(scene, Grid(grid.matrix, (4, 3, 3), "Room")) is None  # --resolution was given
    assert probe_objects.edits_of(scene, Grid(grid.matrix, (3, 3, 3), "fitted volume")) is None
