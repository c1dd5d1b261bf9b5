# SPDX-License-Identifier: GPL-3.0-or-later
"""Culled nodes that capture all the same, and the light of those that do not."""

import numpy as np
import pytest
from gridlight.bake.finish import complete
from gridlight.bake.outcome import BlockOutcome
from gridlight.bake.result import BakeResult
from gridlight.core.conventions import ACTIVE, CULLED, DEPTH_EDGE
from gridlight.core.grid import Grid
from gridlight.core.open_air import OPEN, open_nodes
from gridlight.core.settings import BakeSettings

pytestmark = pytest.mark.any_version


def shell_of(edge):
    """A grid of ``edge``³ nodes, of which the outermost are active."""
    grid = Grid.from_bounds([0, 0, 0], [edge - 1] * 3, (edge,) * 3)
    lattice = grid.lattice()
    state = np.where(((lattice == 0) | (lattice == edge - 1)).any(axis=1), ACTIVE, CULLED).astype(np.uint8)
    return grid, state, np.abs(np.stack([lattice, edge - 1 - lattice])).min(axis=(0, 2))


def test_nodes_beside_active_ones_are_captured_and_deeper_ones_now_and_then():
    grid, state, depth = shell_of(13)
    chosen = open_nodes(grid, state, np.zeros(grid.count, bool))
    assert set(np.flatnonzero(depth == 1)) <= set(chosen)
    lattice = grid.lattice()[chosen]
    for layer, stride in ((2, 2), (3, 2), (4, 4), (6, 4)):
        here = lattice[depth[chosen] == layer]
        assert (here % stride == 0).all() and len(here) == (grid.lattice()[depth == layer] % stride == 0).all(1).sum()
    assert (state[chosen] == CULLED).all()


def test_where_most_is_open_air_few_are_captured():
    """An active plane under high air: never more than as many again."""
    grid = Grid.from_bounds([0, 0, 0], [19, 19, 39], (20, 20, 40))
    state = np.where(grid.lattice()[:, 2] == 0, ACTIVE, CULLED).astype(np.uint8)
    chosen = open_nodes(grid, state, np.zeros(grid.count, bool))
    assert 0 < len(chosen) <= 400


def test_nodes_that_were_switched_off_stay_off():
    grid, state, depth = shell_of(5)
    off = depth == 1
    assert not np.isin(open_nodes(grid, state, off), np.flatnonzero(off)).any()


def test_none_without_active_nodes():
    grid, state, _depth = shell_of(4)
    assert not len(open_nodes(grid, np.full_like(state, CULLED), np.zeros(grid.count, bool)))


def test_what_they_captured_is_kept_and_what_is_buried_is_filled():
    """Five nodes in a row: two in the open hold light of their own, one of them inside a solid."""
    grid = Grid.from_bounds([0, -1, -1], [4, 1, 1], (5, 1, 1))
    state = np.array([ACTIVE, OPEN, OPEN, ACTIVE, CULLED], np.uint8)
    shares = np.zeros((4, 4), np.float32)
    shares[:, 2] = 1.0
    shares[2] = (1.0, 0.0, 0.0, 1.0)  # nothing but back faces of solids
    coefficients = np.zeros((4, 9, 3), np.float32)
    coefficients[:, 0] = np.array([1.0, 7.0, 9.0, 3.0])[:, None]
    outcome = BlockOutcome(
        np.arange(4),
        np.zeros((4, 3), np.float32),
        shares,
        coefficients,
        np.ones((4, DEPTH_EDGE**2, 4), np.float32),
        np.ones((4, 3, 9, 3), np.float32),
        np.array([3, 2]),
    )
    result = BakeResult()
    complete(result, grid, BakeSettings(), state, np.zeros((5, 3)), [outcome], "row")
    field = result.field
    np.testing.assert_array_equal(field.state, [ACTIVE, CULLED, CULLED, ACTIVE, CULLED])
    np.testing.assert_array_equal(field.holds_light, [True, True, False, True, False])
    np.testing.assert_allclose(field.coefficients[:, 0, 0], [1, 7, 5, 3, 3], rtol=1e-5)
    assert not field.gradient[[2, 4]].any() and field.gradient[1].any()
    assert result.counts == {"total": 5, "active": 2, "culled": 3, "invalid": 0}
    assert "1 of 2 probes stand in closed hollows" in result.warnings[0] and "(3, 0, 0)." in result.warnings[0]
