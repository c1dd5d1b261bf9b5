# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes in the scene and volumes fitted to one."""

import math

import bpy
import numpy as np
import pytest
from gridlight.core.errors import InputError
from gridlight.core.grid import Grid
from gridlight.scene.read import read_scene
from gridlight.scene.volume_fit import fit_volume, fitted_bounds
from gridlight.scene.volumes import create_volume, find_volumes
from mathutils import Euler, Matrix
from scene_builders import empty_scene, material, place, quad


@pytest.fixture
def scene():
    return empty_scene()


def room(size=(8, 6, 2.5)):
    """Inward-facing walls from the origin's floor up."""
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0, 0, size[2] / 2))
    bpy.context.object.scale = size
    bpy.context.object.name = "room"


def test_created_volumes_are_found_again(scene):
    matrix = Matrix.LocRotScale((1, 2, 3), Euler((0.1, 0.2, 0.3)), (4, 5, 6))
    item = create_volume(scene, "Hall", np.array(matrix), (11, 4, 7))
    item.empty_display_size = 2.0
    item.scale = (2, 2.5, 3)
    item.hide_render = item.hide_viewport = True
    bpy.context.view_layer.update()
    place(None, "just an empty")
    (volume,) = find_volumes(scene)
    assert volume.name == "Hall" and volume.resolution == (11, 4, 7)
    assert read_scene(scene).volumes[0].name == "Hall"


def test_display_size_is_part_of_the_box(scene):
    item = create_volume(scene, "Box", np.diag([1.0, 2.0, 3.0, 1.0]), (2, 2, 2))
    item.empty_display_size = 2.0
    bpy.context.view_layer.update()
    assert np.allclose(find_volumes(scene)[0].matrix, np.diag([2, 4, 6, 1]))


def test_a_room_is_covered_by_cells_with_a_layer_outside(scene):
    room()
    grid = fit_volume(read_scene(scene), spacing=1.0)
    assert grid.resolution == (10, 8, 4)
    positions = grid.positions()
    assert np.allclose(positions.min(axis=0), [-4.5, -3.5, -0.625]) and np.allclose(
        positions.max(axis=0), [4.5, 3.5, 3.125]
    )
    assert isinstance(grid, Grid)


def test_default_spacing_gives_a_sensible_count(scene):
    room()
    assert 300 <= fit_volume(read_scene(scene)).count <= 4000


@pytest.mark.parametrize("factor", [0.01, 1000.0])
def test_scale_of_the_scene_does_not_matter(scene, factor):
    room((8 * factor, 6 * factor, 2.5 * factor))
    assert 300 <= fit_volume(read_scene(scene)).count <= 4000


def test_ground_plane_sky_dome_and_straggler_are_left_out(scene):
    room()
    place(quad("ground"), "ground", scale=(500, 500, 1))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=200)
    bpy.context.object.name = "dome"
    bpy.context.object.data.materials.append(material("sky", "ShaderNodeEmission"))
    place(quad("compass"), "compass", scale=(0.05, 0.05, 1), location=(0, 0, 40))
    low, high, left_out = fitted_bounds(read_scene(scene))
    assert set(left_out) == {"ground", "dome", "compass"}
    assert (low > [-6, -5, -2]).all() and (high < [6, 5, 5]).all()
    assert (low <= [-4, -3, 0]).all() and (high >= [4, 3, 2.5]).all()


def test_a_hall_with_one_small_thing_stays_the_hall(scene):
    room((30, 20, 8))
    bpy.ops.mesh.primitive_cube_add(size=1.5, location=(3, 3, 0.75))
    low, high, left_out = fitted_bounds(read_scene(scene))
    assert not left_out and np.allclose(low, [-15, -10, 0]) and np.allclose(high, [15, 10, 8])


def test_a_flat_scene_has_probes_on_both_sides(scene):
    place(quad("alone"))
    grid = fit_volume(read_scene(scene))
    heights = np.unique(grid.positions()[:, 2].round(9))
    assert len(heights) == 2 and heights[0] < 0 < heights[1]


@pytest.mark.parametrize("resolution", [(1, 1, 1), (2, 2, 2), (11, 4, 7), (256, 1, 3)])
def test_given_resolutions_are_kept(scene, resolution):
    room()
    assert fit_volume(read_scene(scene), resolution=resolution).resolution == resolution


def test_tiny_spacing_is_limited(scene):
    room()
    assert max(fit_volume(read_scene(scene), spacing=0.001).resolution) <= 256


@pytest.mark.parametrize("spacing", [0, -1, math.nan])
def test_bad_spacing_is_refused(scene, spacing):
    room()
    with pytest.raises(InputError, match="--spacing"):
        fit_volume(read_scene(scene), spacing=spacing)


def test_an_empty_scene_is_refused(scene):
    with pytest.raises(InputError, match="no surface"):
        fit_volume(read_scene(scene))
