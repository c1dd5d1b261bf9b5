# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probes are needed: the exact overlap test, counts that can be told by hand, and the rule for what lies
outside."""

import resource
import time

import numpy as np
import pytest
from gridlight.core.culling import needed_nodes, occupied_cells, triangles_overlap_boxes
from gridlight.core.grid import Grid


def quad(a, b, c, d):
    return np.array([[a, b, c], [a, c, d]], float)


def floor(x0, x1, y0, y1, z):
    return quad((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z))


def box(low, high):
    """Twelve triangles."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    sides = [quad((x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)) for z in (z0, z1)]
    sides += [quad((x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)) for y in (y0, y1)]
    sides += [quad((x, y0, z0), (x, y1, z0), (x, y1, z1), (x, y0, z1)) for x in (x0, x1)]
    return np.concatenate(sides)


def unit_grid(nx, ny, nz):
    """Cells are unit cubes, the first from the origin."""
    return Grid.from_bounds([0, 0, 0], [nx - 1, ny - 1, nz - 1], (nx, ny, nz))


def test_overlap_agrees_with_dense_sampling():
    """No sample of a triangle may lie in a box that is called free; a box that is called hit has a sample near it."""
    generator = np.random.default_rng(0)
    count = 3000
    triangles = generator.uniform(-1.5, 1.5, (count, 3, 3))
    half = generator.uniform(0.1, 0.6, (count, 3))
    centres = generator.uniform(-0.5, 0.5, (count, 3))
    overlap = triangles_overlap_boxes(triangles, centres, half)
    steps = 60
    i, j = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1))
    inside = i + j <= steps
    u, v = i[inside] / steps, j[inside] / steps
    weights = np.stack([1 - u - v, u, v], axis=1)
    outside_by = np.empty(count)
    for row in range(count):
        points = weights @ triangles[row] - centres[row]
        outside_by[row] = (np.abs(points) - half[row]).max(axis=1).min()
    assert 0.2 < overlap.mean() < 0.8
    assert not (~overlap & (outside_by <= 0)).any()
    spacing = np.linalg.norm(np.roll(triangles, 1, axis=1) - triangles, axis=2).max(axis=1) / steps
    assert not (overlap & (outside_by > spacing)).any()


def test_every_separating_axis_matters():
    """A triangle beside a box's edge: its bounds overlap the box, only an edge's cross product separates them."""
    triangle = np.array([[[2.1, 0, 0.3], [0, 2.1, 0.3], [2.1, 2.1, 0.3]]])
    one = np.ones((1, 3))
    assert not triangles_overlap_boxes(triangle, 0 * one, one)[0]
    assert triangles_overlap_boxes(triangle - [0.11, 0.11, 0], 0 * one, one)[0]


def test_a_triangle_within_a_box_and_a_box_within_a_triangle():
    one = np.ones((1, 3))
    assert triangles_overlap_boxes(np.array([[[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]]]), 0 * one, one)[0]
    assert triangles_overlap_boxes(np.array([[[-50, -50, 0.9], [50, -50, 0.9], [0, 50, 0.9]]]), 0 * one, one)[0]
    assert not triangles_overlap_boxes(np.array([[[-50, -50, 1.1], [50, -50, 1.1], [0, 50, 1.1]]]), 0 * one, one)[0]


def test_touching_counts():
    one = np.ones((1, 3))
    assert triangles_overlap_boxes(np.array([[[-1, -1, 1.0], [1, -1, 1], [0, 1, 1]]]), 0 * one, one)[0]


def test_a_floor_within_the_lowest_cells_needs_two_layers():
    grid = unit_grid(5, 6, 4)
    needed = needed_nodes(grid, floor(0, 4, 0, 5, 0.5)).reshape(4, 6, 5)
    assert needed[:2].all() and not needed[2:].any()


def test_a_floor_on_a_cell_face_belongs_to_both_sides():
    grid = unit_grid(5, 5, 5)
    needed = needed_nodes(grid, floor(0.2, 3.8, 0.2, 3.8, 2.0)).reshape(5, 5, 5)
    assert needed[1:4].all() and not needed[0].any() and not needed[4].any()


def test_a_small_box_in_a_corner_needs_eight_nodes():
    needed = needed_nodes(unit_grid(5, 5, 5), box((0.2, 0.2, 0.2), (0.8, 0.8, 0.8))).reshape(5, 5, 5)
    assert needed.sum() == 8 and needed[:2, :2, :2].all()


def test_a_triangle_in_one_cell_of_a_large_grid():
    triangle = np.array([[[7.2, 3.2, 5.2], [7.8, 3.3, 5.4], [7.5, 3.8, 5.9]]])
    needed = np.argwhere(needed_nodes(unit_grid(11, 11, 11), triangle).reshape(11, 11, 11))
    assert sorted(map(tuple, needed)) == [(k, j, i) for k in (5, 6) for j in (3, 4) for i in (7, 8)]


def test_a_diagonal_triangle_does_not_fill_its_bounds():
    triangle = np.array([[[0.5, 0.5, 0.5], [8.5, 8.5, 0.5], [8.5, 8.5, 0.6]]])
    cells = occupied_cells(unit_grid(10, 10, 10), triangle, 0.5)
    assert {tuple(cell) for cell in np.argwhere(cells)} >= {(i, i, 0) for i in range(9)}
    assert not cells[0, 4, 0] and cells.sum() < 30


def test_surface_half_a_cell_beyond_the_box_counts():
    grid = unit_grid(5, 5, 5)
    assert needed_nodes(grid, floor(0.1, 3.9, 0.1, 3.9, -0.4)).reshape(5, 5, 5)[:2].all()


def test_distant_surface_gets_one_layer_where_nothing_else_serves_it():
    grid = unit_grid(5, 5, 5)
    far = floor(0.1, 3.9, 0.1, 3.9, -3.0)
    needed = needed_nodes(grid, far).reshape(5, 5, 5)
    assert needed[:2].all() and not needed[2:].any()


def test_distant_surface_adds_nothing_where_a_corner_is_lit_already():
    """Beside a floor in the lowest layer, ground outside clamps to cells that have lit corners."""
    grid = unit_grid(5, 5, 5)
    near = floor(0, 4, 0, 4, 0.5)
    ground = floor(-100, 100, -100, 100, -20.0)
    assert (needed_nodes(grid, np.concatenate([near, ground])) == needed_nodes(grid, near)).all()


def test_a_huge_ground_plane_far_below():
    needed = needed_nodes(unit_grid(5, 5, 5), floor(-1e5, 1e5, -1e5, 1e5, -50.0)).reshape(5, 5, 5)
    assert needed[:2].all() and not needed[2:].any()


def test_axes_with_one_node():
    grid = Grid.from_bounds([0, 0, 0], [4, 4, 1], (5, 5, 1))
    needed = needed_nodes(grid, floor(0.2, 0.8, 0.2, 0.8, 0.5))
    assert needed.shape == (25,)
    assert needed.reshape(5, 5)[:2, :2].all() and needed.sum() == 4


def test_a_rotated_volume_culls_like_a_rotated_scene():
    generator = np.random.default_rng(2)
    triangles = generator.uniform(0, 8, (40, 1, 3)) + generator.normal(0, 0.3, (40, 3, 3))
    rotation, _ = np.linalg.qr(generator.normal(size=(3, 3)))
    straight = unit_grid(9, 9, 9)
    matrix = np.eye(4)
    matrix[:3, :3] = rotation @ straight.matrix[:3, :3]
    matrix[:3, 3] = rotation @ straight.matrix[:3, 3]
    turned = needed_nodes(Grid(matrix, (9, 9, 9)), triangles @ rotation.T)
    assert (turned == needed_nodes(straight, triangles)).all() and 0 < turned.sum() < 729


def test_every_surface_point_has_a_needed_corner():
    """The purpose of the rule: no lookup on a surface, inside or outside the box, finds only culled probes."""
    generator = np.random.default_rng(3)
    grid = unit_grid(6, 6, 6)
    triangles = generator.uniform(-8, 13, (60, 1, 3)) + generator.normal(0, 1.0, (60, 3, 3))
    needed = needed_nodes(grid, triangles)
    weights = generator.dirichlet([1, 1, 1], 500)
    points = np.einsum("sc,tcx->tsx", weights, triangles).reshape(-1, 3)
    cell = np.minimum(np.clip(points, 0, 5).astype(int), 4)
    corners = cell[:, None] + np.array(list(np.ndindex(2, 2, 2)))
    flat = corners[..., 0] + 6 * (corners[..., 1] + 6 * corners[..., 2])
    assert needed[flat].any(axis=1).all()


def test_degenerate_triangles_do_no_harm():
    point = np.tile([[2.5, 2.5, 2.5]], (1, 3, 1))
    assert needed_nodes(unit_grid(5, 5, 5), point).sum() == 8


@pytest.mark.nightly
def test_a_hundred_thousand_probes_and_a_million_triangles():
    """The budget: 20 s and 2 GB."""
    generator = np.random.default_rng(0)
    triangles = generator.uniform(0, 49, (1_000_000, 1, 3)) + generator.normal(0, 0.3, (1_000_000, 3, 3))
    grid = Grid.from_bounds([0, 0, 0], [49, 49, 39], (50, 50, 40))
    start = time.perf_counter()
    needed = needed_nodes(grid, triangles)
    seconds = time.perf_counter() - start
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{seconds:.1f} s, peak of the process {peak_mib:.0f} MiB")
    assert needed.mean() > 0.9
    assert seconds < 20 and peak_mib < 2048
