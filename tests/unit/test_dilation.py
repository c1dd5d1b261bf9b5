# SPDX-License-Identifier: GPL-3.0-or-later
"""Light for probes without their own: what is filled, with what, and what stays as it was baked."""

import numpy as np
from gridlight.core import dilation
from gridlight.core.grid import Grid


def line(count):
    return Grid.from_bounds([0, 0, 0], [1, 1, 1], (count, 1, 1))


def test_baked_probes_stay_as_they_are():
    grid = Grid.from_bounds([0] * 3, [1] * 3, (4, 4, 4))
    generator = np.random.default_rng(0)
    coefficients = generator.random((64, 9, 3)).astype(np.float32)
    active = generator.random(64) < 0.5
    filled = dilation.fill(grid, coefficients, active)
    assert filled.dtype == np.float32
    assert (filled[active] == coefficients[active]).all()
    assert not (filled[~active] == coefficients[~active]).all()


def test_a_gap_in_a_line_is_bridged_linearly():
    """The Laplace equation in one dimension has straight lines as solutions."""
    coefficients = np.zeros((5, 1, 3))
    coefficients[4] = (4, 8, 0)
    filled = dilation.fill(line(5), coefficients, np.array([True, False, False, False, True]))
    np.testing.assert_allclose(filled[:, 0, 0], [0, 1, 2, 3, 4], atol=1e-3)
    np.testing.assert_allclose(filled[:, 0, 1], [0, 2, 4, 6, 8], atol=1e-3)


def test_values_stay_between_those_that_were_baked():
    grid = Grid.from_bounds([0] * 3, [1] * 3, (6, 5, 4))
    generator = np.random.default_rng(1)
    active = generator.random(120) < 0.1
    coefficients = np.where(active[:, None, None], generator.uniform(2, 3, (120, 4, 3)), 1e6)
    filled = dilation.fill(grid, coefficients, active)
    assert filled.min() >= 2 and filled.max() <= 3


def test_one_active_probe_fills_all():
    grid = Grid.from_bounds([0] * 3, [1] * 3, (3, 3, 3))
    coefficients = np.zeros((27, 1, 3))
    coefficients[13] = 7
    np.testing.assert_allclose(dilation.fill(grid, coefficients, np.arange(27) == 13), 7)


def test_nothing_active_changes_nothing():
    coefficients = np.ones((5, 1, 3))
    assert (dilation.fill(line(5), coefficients, np.zeros(5, bool)) == coefficients).all()
