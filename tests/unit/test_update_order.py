# SPDX-License-Identifier: GPL-3.0-or-later
"""The order of partial updates: all probes, shuffled, changed ones early, left-out ones first."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.snapshot import Light
from gridlight.core.update_order import change_weights, update_order

NONE_WAITS = np.zeros(400, bool)


def lamp(place, color=(1.0, 1.0, 1.0), kind="POINT"):
    matrix = np.eye(4)
    matrix[:3, 3] = place
    return Light("lamp", kind, color, matrix)


def test_every_probe_once_in_an_order_without_pattern():
    order = update_order(np.ones(400), NONE_WAITS, 1)
    assert sorted(order) == list(range(400))
    assert abs(np.corrcoef(order, np.arange(400))[0, 1]) < 0.15
    assert np.abs(np.diff(order)).mean() == pytest.approx(400 / 3, rel=0.15)  # of a random permutation
    assert (order != update_order(np.ones(400), NONE_WAITS, 2)).mean() > 0.9


def test_weights_are_chances_to_be_first():
    """The first of an order is probe i with probability w_i / Σ w."""
    weights = np.array([1.0, 2.0, 5.0])
    first = [update_order(weights, np.zeros(3, bool), seed)[0] for seed in range(4000)]
    assert np.bincount(first) / 4000 == pytest.approx(weights / 8, abs=0.025)


def test_probes_that_wait_come_first():
    waiting = np.zeros(400, bool)
    waiting[100:150] = True
    order = update_order(np.where(waiting, 0.01, 100.0), waiting, 3)
    assert sorted(order[:50]) == list(range(100, 150))


def test_a_lamp_that_moved_counts_where_it_was_and_where_it_is():
    positions = np.array([[0.0, 0, 0], [10.0, 0, 0], [5.0, 8.0, 0]])
    before, after = lamp((0, 0, 1)), lamp((10, 0, 1))
    weights = change_weights(positions, [before], [after], 1.0)
    assert weights[0] == pytest.approx(weights[1]) and weights[0] > 5 * weights[2] > 0
    other = lamp((5, 8, 1))
    assert change_weights(positions, [before, other], [after, other], 1.0) == pytest.approx(weights)
    assert change_weights(positions, [before], [], 1.0)[0] > change_weights(positions, [before], [], 1.0)[1]


def test_alike_where_nothing_tells_them_apart():
    positions = np.random.default_rng(0).random((20, 3))
    sun = lamp((0, 0, 0), kind="SUN")
    brighter = replace(sun, color=(3.0, 3.0, 3.0))
    for old, new in (([], []), ([sun], [sun]), ([sun], [brighter])):
        weights = change_weights(positions, old, new, 1.0)
        assert np.ptp(weights) == 0 and (weights > 0).all()
