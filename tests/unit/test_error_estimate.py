# SPDX-License-Identifier: GPL-3.0-or-later
"""The error estimate against fields whose interpolation error is known in closed form."""

import numpy as np
import pytest
from gridlight.core.conventions import CULLED
from gridlight.core.error_estimate import interpolation_error
from gridlight.core.field import Field
from gridlight.core.grid import Grid


def field_of(light, resolution=(9, 5, 4), high=(4.0, 2.0, 1.5), bands=2):
    """A field whose band 0 is ``light`` of the positions (P, 3)."""
    field = Field.empty(Grid.from_bounds((0, 0, 0), high, resolution), bands)
    field.coefficients[:, 0] = light(field.grid.positions())[:, None]
    return field


def test_light_that_is_linear_in_space_is_interpolated_without_error():
    field = field_of(lambda p: 3.0 + p @ [0.5, -0.2, 0.1])
    assert interpolation_error(field).max() < 1e-6


def test_quadratic_light_has_the_error_in_the_middle_of_a_cell():
    """c + a·x²/2: linear interpolation is off by a·h²/8 in the middle, everywhere the same."""
    a, c, h = 0.6, 20.0, 0.5
    error = interpolation_error(field_of(lambda p: c + a * p[:, 0] ** 2 / 2))
    field = field_of(lambda p: c + a * p[:, 0] ** 2 / 2)
    nodes = field.grid.lattice()
    light = field.coefficients[:, 0, 0].astype(float)
    first = np.flatnonzero((nodes[:, 0] < 8) & (nodes[:, 1] < 4) & (nodes[:, 2] < 3))
    expected = a * h * h / 8 / ((light[first] + light[first + 1]) / 2)
    np.testing.assert_allclose(error[first], expected, rtol=2e-3)


def test_nothing_is_known_beside_probes_without_light_of_their_own():
    field = field_of(lambda p: 5.0 + np.sin(3 * p[:, 0]))
    field.state[:] = CULLED
    assert not interpolation_error(field).any()


@pytest.mark.parametrize("resolution", [(1, 1, 1), (2, 2, 2), (1, 4, 2), (3, 1, 1)])
def test_small_grids(resolution):
    field = field_of(lambda p: 1.0 + p[:, 0], resolution)
    error = interpolation_error(field)
    assert error.shape == (field.grid.count,) and error.max() < 1e-6


def test_irradiance_counts_not_radiance():
    """The fourth band is invisible to diffuse surfaces, so noise in it is no error."""
    field = field_of(lambda p: np.full(len(p), 2.0), bands=4)
    field.coefficients[:, 9:] = np.random.default_rng(0).normal(size=field.coefficients[:, 9:].shape)
    assert interpolation_error(field).max() < 1e-6
