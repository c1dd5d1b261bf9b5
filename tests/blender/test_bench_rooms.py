# SPDX-License-Identifier: GPL-3.0-or-later
"""The rooms of the benchmarks: the Cornell room is the one that accuracy is tested in; the hall is closed and has as
many triangles as asked for."""

import numpy as np
import pytest
from gridlight.cli import bench_scenes
from gridlight.scene.bench_rooms import HALL_SIZE_M, build_cornell, build_hall
from gridlight.scene.read import read_scene
from gridlight.tests.scenes import cornell
from mathutils.bvhtree import BVHTree


def sorted_rows(rows):
    return rows[np.lexsort(np.round(rows, 5).T)]


def corners(snapshot):
    """(3T, 10): place, shading normal, reflectance of every triangle's corners, in an order of their own."""
    colours = np.array([material.base_color for material in snapshot.materials])[snapshot.material_index]
    rows = np.concatenate(
        [snapshot.triangle_positions, snapshot.corner_normals, np.repeat(colours[:, None], 3, axis=1)], axis=2
    )
    return sorted_rows(rows.reshape(-1, 9))


def test_the_cornell_room_is_that_of_the_tests():
    bench = read_scene(build_cornell(bench_scenes.empty_scene()))
    tested = read_scene(cornell("thick"))
    np.testing.assert_allclose(corners(bench), corners(tested), atol=1e-6)
    assert [(light.kind, light.color, light.size_x, light.size_y) for light in bench.lights] == [
        (light.kind, light.color, light.size_x, light.size_y) for light in tested.lights
    ]
    assert not any(bench.world.color) and not bench.warnings


@pytest.mark.parametrize("triangles", [1000, 30_000])
def test_the_hall_is_closed_and_as_large_as_asked_for(triangles):
    snapshot = read_scene(build_hall(bench_scenes.empty_scene(), triangles))
    assert len(snapshot.triangles) == pytest.approx(triangles, rel=0.05)
    positions = snapshot.triangle_positions
    face_normals = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    assert (np.einsum("tk,tck->tc", face_normals, snapshot.corner_normals) > 0).all(), "normals are those of triangles"
    tree = BVHTree.FromPolygons(snapshot.vertices.tolist(), snapshot.triangles.tolist(), all_triangles=True)
    directions = np.random.default_rng(0).normal(size=(300, 3))
    for direction in directions.tolist():
        assert tree.ray_cast(HALL_SIZE_M * (0.5, 0.5, 0.9), direction)[0] is not None
