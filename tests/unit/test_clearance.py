# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes keep their distance: out of touch with walls, edges and corners, through none of them, and never far."""

import numpy as np
import pytest
from gridlight.core.clearance import CLEARANCE, Obstacles, keep_clear, nearest_points
from gridlight.core.grid import Grid
from gridlight.core.snapshot import Material, SceneSnapshot, World


def box(low, high):
    """(12, 3, 3) triangles whose normals point outwards."""
    x, y, z = np.stack([low, high], axis=1).astype(float)
    corners = np.array([[a, b, c] for c in z for b in y for a in x])
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    return corners[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])]


INSIDE_OUT = box([0] * 3, [4] * 3)[:, ::-1]  # a room of 4 m: its front is inside


def cleared(grid, triangles, near=CLEARANCE, **options):
    """All that are nearer than the clearance move, unless a test asks for less."""
    nodes = np.arange(grid.count)
    return keep_clear(grid, nodes, grid.positions(), Obstacles.all_of(grid, triangles), near=near, **options)


def distance_to(triangles, points):
    pairs = np.repeat(points, len(triangles), axis=0)
    nearest = nearest_points(np.tile(triangles, (len(points), 1, 1)), pairs)
    return np.linalg.norm(pairs - nearest, axis=1).reshape(len(points), -1).min(axis=1)


def test_nearest_points_are_those_of_a_search():
    random = np.random.default_rng(0)
    triangles, points = random.normal(size=(200, 3, 3)), 2 * random.normal(size=(200, 3))
    u, v = np.meshgrid(np.linspace(0, 1, 101), np.linspace(0, 1, 101))
    u, v = u[u + v <= 1], v[u + v <= 1]
    a, b, c = (triangles[:, corner, None] for corner in range(3))
    tried = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    least = np.linalg.norm(tried - points[:, None], axis=2).min(axis=1)
    found = np.linalg.norm(nearest_points(triangles, points) - points, axis=1)
    assert (found <= least + 1e-12).all()
    np.testing.assert_allclose(found, least, atol=0.03)


@pytest.mark.parametrize("inset", [0.0, 1e-9, -1e-9, 0.01, 0.1])
def test_probes_on_walls_edges_and_corners_step_into_the_room(inset):
    grid = Grid.from_bounds([inset] * 3, [4 - inset] * 3, (5, 5, 5))
    found = cleared(grid, INSIDE_OUT)
    clearance = CLEARANCE * grid.cell_size().min()
    np.testing.assert_allclose(found, np.clip(grid.positions(), clearance, 4 - clearance), atol=1e-6)


def test_probes_far_from_surfaces_stay():
    grid = Grid.from_bounds([1] * 3, [3] * 3, (3, 3, 3))
    np.testing.assert_array_equal(cleared(grid, INSIDE_OUT), grid.positions())
    np.testing.assert_array_equal(cleared(grid, np.zeros((0, 3, 3))), grid.positions())


def test_only_probes_that_nearly_touch_move():
    for inset, moves in ((0.0, True), (0.01, True), (0.05, False), (0.15, False)):
        grid = Grid.from_bounds([inset] * 3, [4 - inset] * 3, (5, 5, 5))
        found = cleared(grid, INSIDE_OUT, near=0.02)
        assert (found != grid.positions()).any() == moves


def test_behind_its_nearest_surface_a_probe_stays_until_it_is_known_to_be_in_a_room():
    grid = Grid.from_bounds([0.05] * 3, [3.95] * 3, (5, 5, 5))
    outward = INSIDE_OUT[:, ::-1]
    np.testing.assert_array_equal(cleared(grid, outward), grid.positions())
    found = cleared(grid, outward, also_behind=True)
    assert (distance_to(outward, found) > 0.999 * CLEARANCE * grid.cell_size().min()).all()


def test_no_probe_goes_through_a_surface_to_get_away_from_another():
    """Two walls closer together than the clearance: what stands between them stays between them."""
    walls = np.concatenate([box((-9, -9, -0.3), (9, 9, -0.05)), box((-9, -9, 0.05), (9, 9, 0.3))])
    grid = Grid.from_bounds([-2] * 3, [2] * 3, (5, 5, 5))
    found = cleared(grid, walls)
    between = np.abs(grid.positions()[:, 2]) < 0.01
    assert between.sum() == 25
    assert (np.abs(found[between, 2]) < 0.05).all()


def test_dust_is_no_obstacle():
    corners = np.concatenate([INSIDE_OUT, box([2.01] * 3, [2.02] * 3)])
    snapshot = SceneSnapshot(
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(72, dtype=np.int32).reshape(-1, 3),
        corner_normals=np.zeros((24, 3, 3), np.float32),
        corner_uvs=np.zeros((24, 3, 2), np.float32),
        material_index=np.zeros(24, np.int32),
        object_index=np.repeat([0, 2], 12),
        object_names=["room", "nothing", "grain"],
        materials=[Material("grey")],
        images=[],
        lights=[],
        world=World(),
    )
    grid = Grid.from_bounds([0] * 3, [4] * 3, (5, 5, 5))
    np.testing.assert_array_equal(Obstacles.of(grid, snapshot).triangles, INSIDE_OUT)


@pytest.mark.parametrize("seed", range(5))
def test_random_scenes(seed):
    """Nobody moves more than half a cell, through a surface, or nearer to any."""
    random = np.random.default_rng(seed)
    triangles = random.uniform(-2, 2, (60, 1, 3)) + random.normal(0, 0.5, (60, 3, 3))
    matrix = np.eye(4)
    matrix[:3, :3] = 2 * np.linalg.qr(random.normal(size=(3, 3)))[0] + 0.2 * random.normal(size=(3, 3))
    grid = Grid(matrix, (5, 6, 7))
    before, after = grid.positions(), cleared(grid, triangles)
    moved = (after != before).any(axis=1)
    assert moved.sum() >= 5
    in_lattice = (after - before) @ grid.world_to_lattice()[:, :3].T
    assert np.abs(in_lattice).max() <= 0.5 + 1e-9
    assert (distance_to(triangles, after)[moved] > distance_to(triangles, before)[moved]).all()
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    for start, end in zip(before[moved], after[moved]):
        height = np.einsum("ti,tci->tc", normal, np.array([start, end])[None] - triangles[:, :1])
        through = np.flatnonzero(height[:, 0] * height[:, 1] < 0)
        place = start + (height[through, 0] / (height[through, 0] - height[through, 1]))[:, None] * (end - start)
        assert not (distance_to_own(triangles[through], place) < 1e-9).any()


def distance_to_own(triangles, points):
    return np.linalg.norm(points - nearest_points(triangles, points), axis=1)
