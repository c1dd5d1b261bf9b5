# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids: where nodes lie, and that lattice coordinates are the inverse, whatever the box and the counts."""

import numpy as np
import pytest
from gridlight.core.errors import InputError
from gridlight.core.grid import Grid
from hypothesis import given
from hypothesis import strategies as st


def rotated_matrix(seed=0, scale=(2.0, 0.5, 3.0), centre=(10, -20, 5)):
    rotation, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * scale
    matrix[:3, 3] = centre
    return matrix


def test_corners_and_order():
    grid = Grid.from_bounds([0, 0, 0], [10, 20, 30], (11, 5, 4))
    positions = grid.positions()
    assert positions.shape == (220, 3) and grid.count == 220
    np.testing.assert_allclose(positions[0], [0, 0, 0], atol=1e-14)
    np.testing.assert_allclose(positions[1], [1, 0, 0], atol=1e-14)
    np.testing.assert_allclose(positions[11], [0, 5, 0], atol=1e-14)
    np.testing.assert_allclose(positions[55], [0, 0, 10], atol=1e-14)
    np.testing.assert_allclose(positions[-1], [10, 20, 30], atol=1e-14)
    np.testing.assert_array_equal(grid.lattice()[[0, 1, 11, 55]], [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def test_a_count_of_one_is_the_middle():
    grid = Grid.from_bounds([0, 0, 0], [10, 20, 30], (1, 1, 2))
    np.testing.assert_allclose(grid.positions(), [[5, 10, 0], [5, 10, 30]], atol=1e-14)
    np.testing.assert_allclose(grid.cell_size(), [10, 20, 30])


@given(st.integers(0, 50), st.tuples(*[st.integers(1, 5)] * 3))
def test_lattice_is_the_inverse_of_positions(seed, resolution):
    grid = Grid(rotated_matrix(seed), resolution)
    to_lattice = grid.world_to_lattice()
    found = grid.positions() @ to_lattice[:, :3].T + to_lattice[:, 3]
    np.testing.assert_allclose(found, grid.lattice(), atol=1e-10)


def test_lattice_far_from_the_origin():
    grid = Grid(rotated_matrix(centre=(1e5, 1e5, -1e5)), (5, 5, 5))
    to_lattice = grid.world_to_lattice()
    np.testing.assert_allclose(grid.positions() @ to_lattice[:, :3].T + to_lattice[:, 3], grid.lattice(), atol=1e-8)


def test_one_node_axis_has_lattice_coordinate_zero_everywhere():
    grid = Grid(rotated_matrix(), (3, 1, 2))
    to_lattice = grid.world_to_lattice()
    assert (to_lattice[1] == 0).all()


def test_grids_with_the_same_nodes():
    grid = Grid.from_bounds((0, 0, 0), (1, 2, 3), (2, 3, 4), "hall")
    assert grid.has_nodes_of(Grid(grid.matrix.copy(), [2, 3, 4], "attic"))
    assert not grid.has_nodes_of(Grid.from_bounds((0, 0, 0), (1, 2, 3), (2, 3, 5)))
    assert not grid.has_nodes_of(Grid.from_bounds((0, 0, 0), (1, 2, 3.5), (2, 3, 4)))


def test_cell_size_of_a_rotated_box():
    np.testing.assert_allclose(Grid(rotated_matrix(), (3, 2, 4)).cell_size(), [2, 1, 2], rtol=1e-12)


@pytest.mark.parametrize("resolution", [(0, 1, 1), (1, -1, 1), (257, 1, 1), (1, 1, 10**6)])
def test_resolution_out_of_range(resolution):
    with pytest.raises(InputError, match="1 to 256"):
        Grid.from_bounds([0] * 3, [1] * 3, resolution)


@pytest.mark.parametrize(
    "low,high,word",
    [
        ([0, 0, 0], [1, 0, 1], "along Y"),
        ([0, 0, 0], [-1, 1, 1], "along X"),
        ([0, 0, np.nan], [1, 1, 1], "finite"),
        ([0, 0, 0], [1, 1, np.inf], "finite"),
    ],
)
def test_bad_bounds(low, high, word):
    with pytest.raises(InputError, match=word):
        Grid.from_bounds(low, high, (2, 2, 2))


def test_flat_and_broken_boxes():
    with pytest.raises(InputError, match="no volume"):
        Grid(np.array([[1, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]), (2, 2, 2))
    with pytest.raises(InputError, match="zero size along Z"):
        Grid(np.diag([1.0, 1, 0, 1]), (2, 2, 2))
    with pytest.raises(InputError, match="not finite"):
        Grid(np.diag([1.0, 1, np.nan, 1]), (2, 2, 2))
