# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways out of walls: inwards, one wall after the other in a corner, never back, never farther than half a cell."""

import numpy as np
from gridlight.core.grid import Grid
from gridlight.core.relocation import inward, moves

GRID = Grid.from_bounds((0, 0, 0), (4, 4, 4), (5, 5, 5))  # cells of 1 m
HOME = np.array([[0.1, 0.1, 0.1]])
STILL = np.zeros((1, 3))
NOWHERE = 1e30


def exits_of(*distances):
    """(1, 6, 4) nearest surfaces straight along +x, −x, +y, −y, +z, −z."""
    directions = np.repeat(np.eye(3), 2, axis=0) * np.tile([[1], [-1]], (3, 1))
    distance = np.array(distances)[:, None]
    return np.concatenate([np.where(distance < NOWHERE, directions * distance, 0.0), distance], axis=1)[None]


def test_the_way_towards_the_middle_is_taken_where_another_is_as_short():
    found = moves(GRID, HOME, exits_of(NOWHERE, NOWHERE, 0.2, 0.2, NOWHERE, NOWHERE), STILL, STILL)
    np.testing.assert_allclose(found, [[0, 0.25, 0]])


def test_from_a_corner_three_ways_lead_inwards():
    """Behind each wall is the next; the nearest surface is the one that the probe came through."""
    moved = moves(GRID, HOME, exits_of(0.2, 0.2, 0.21, 0.2, 0.22, 0.2), STILL, STILL)
    moved = moved + moves(GRID, HOME, exits_of(NOWHERE, 0.05, 0.21, 0.2, 0.22, 0.2), moved, STILL)
    moved = moved + moves(GRID, HOME, exits_of(NOWHERE, NOWHERE, NOWHERE, 0.05, 0.22, 0.2), moved, STILL)
    np.testing.assert_allclose(moved, [[0.25, 0.26, 0.27]])


def test_half_a_cell_is_the_farthest_in_all():
    assert not moves(GRID, HOME, exits_of(0.46, NOWHERE, NOWHERE, NOWHERE, NOWHERE, NOWHERE), STILL, STILL).any()
    before = np.array([[0.3, 0.0, 0.0]])
    assert not moves(GRID, HOME, exits_of(0.2, NOWHERE, NOWHERE, NOWHERE, NOWHERE, NOWHERE), before, STILL).any()


def test_a_way_that_led_nowhere_is_not_tried_again():
    """Out of the near side of a wall lies the void, out of the far one the room."""
    out = exits_of(0.1, 0.2, NOWHERE, NOWHERE, NOWHERE, NOWHERE)
    first = moves(GRID, HOME, out, STILL, STILL)
    np.testing.assert_allclose(first, [[0.15, 0, 0]])
    np.testing.assert_allclose(moves(GRID, HOME, out, STILL, first), [[-0.25, 0, 0]])
    assert not moves(GRID, HOME, exits_of(0.1, *[NOWHERE] * 5), STILL, first).any()


def test_the_last_way_leads_away_from_the_faces_of_the_box():
    turn = np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * [4.0, 2.0, 1.0]
    volume = Grid(matrix, (5, 3, 1))  # cells of 2 m along both axes, one layer
    corner, side, middle, end = 0, 2, 7, 14
    found = inward(volume, np.array([corner, side, middle, end]), 0.25)
    np.testing.assert_allclose(found, np.array([[0.5, 0.5, 0], [0, 0.5, 0], [0, 0, 0], [-0.5, -0.5, 0]]) @ turn.T)
