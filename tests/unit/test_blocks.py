# SPDX-License-Identifier: GPL-3.0-or-later
"""Blocks of a grid: every node in exactly one, compact, in boxes that lie where their nodes do."""

import numpy as np
import pytest
from gridlight.core.blocks import cut
from gridlight.core.grid import Grid
from gridlight.core.patches import Patches


def skewed(resolution):
    """A turned box with sides of 8, 4 and 2 m, off the origin."""
    angle = 0.6
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array([4.0, 2.0, 1.0])
    matrix[:3, 3] = (10.0, -20.0, 3.0)
    return Grid(matrix, resolution)


@pytest.mark.parametrize("resolution", [(7, 4, 1), (1, 1, 1), (16, 16, 16), (33, 9, 5), (256, 1, 1), (2, 3, 200)])
@pytest.mark.parametrize("most", [1, 8, 100, 4096])
def test_every_node_is_in_exactly_one_block(resolution, most):
    blocks = cut(skewed(resolution), most)
    nodes = np.concatenate([block.nodes() for block in blocks])
    np.testing.assert_array_equal(np.sort(nodes), np.arange(np.prod(resolution)))
    assert all(block.size <= most and len(block.nodes()) == block.size for block in blocks)
    assert [block.index for block in blocks] == list(range(len(blocks)))
    assert len(blocks) == 1 or all(2 * block.size + 2 > most / 2 for block in blocks) or max(resolution) > most


@pytest.mark.parametrize("resolution", [(9, 5, 3), (9, 1, 3), (9, 2, 1)])
def test_boxes_lie_where_the_nodes_do(resolution):
    grid = skewed(resolution)
    for block in cut(grid, 4):
        own = block.grid(grid)
        np.testing.assert_allclose(own.positions(), grid.positions()[block.nodes()], atol=1e-12)
        np.testing.assert_allclose(own.cell_size(), grid.cell_size(), rtol=1e-12)
        np.testing.assert_array_equal(own.origin, grid.center)


def test_a_grid_of_one_block_is_itself():
    grid = skewed((9, 5, 3))
    (block,) = cut(grid, 4096)
    assert block.is_whole and block.grid(grid) is grid and block.seed(7) == 7


def test_blocks_are_compact_in_metres_not_in_nodes():
    """2 m in 64 nodes stay together while 8 m in 4 nodes are cut."""
    grid = skewed((4, 1, 64))
    blocks = cut(grid, 64)
    assert all(block.shape[2] == 64 for block in blocks) and len(blocks) == 4


def test_equal_sides_are_cut_in_order_whatever_the_rounding():
    for noise in (-1e-9, 0.0, 1e-9):
        grid = Grid.from_bounds((0, 0, 0), (1 + noise, 1, 1 - noise), (4, 4, 4))
        assert cut(grid, 32)[0].shape == (2, 4, 4)


def test_seeds_differ_and_are_valid():
    blocks = cut(Grid.from_bounds((0, 0, 0), (1, 1, 1), (32, 32, 32)), 8)
    seeds = {block.seed(2**31 - 1) for block in blocks}
    assert len(seeds) == len(blocks) == 4096 and all(0 <= seed < 2**31 for seed in seeds)


def test_cells_of_patches_grow_with_the_distance_from_the_block():
    """A block's patches are those of a grid by itself: the frame of the whole does not matter."""
    whole = Grid.from_bounds((-20, -1, -1), (20, 1, 1), (81, 5, 5))
    block = cut(whole, 125)[-1]
    own = block.grid(whole)
    alone = Grid(own.matrix, own.resolution)
    generator = np.random.default_rng(0)
    hits = np.zeros((40000, 4), np.float32)
    shift = own.center - own.origin
    hits[:, :3] = shift + generator.uniform((-12, -12, 0), (12, 12, 0), (40000, 3))  # a floor
    hits[:, 3] = 2048 * 4097
    counts = []
    for grid, frame in ((own, 0.0), (alone, shift), (whole, 0.0)):
        patches = Patches(grid)
        moved = hits - np.append(frame * np.ones(3), 0).astype(np.float32)
        patches.bind(moved, None, lambda items, _patches: np.ones(len(items), bool))
        counts.append(patches.count)
    assert abs(counts[0] - counts[1]) < 0.02 * counts[1]  # cells lie elsewhere, that is all
    assert counts[0] < 0.7 * counts[2]  # the whole's box reaches everywhere: no cell grows
