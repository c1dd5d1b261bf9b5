# SPDX-License-Identifier: GPL-3.0-or-later
"""The error estimate against fields whose interpolation error is known in closed form."""

import numpy as np
import pytest
from gridlight.core import lookup
from gridlight.core.conventions import CULLED
from gridlight.core.error_estimate import interpolation_error
from gridlight.core.field import Field
from gridlight.core.grid import Grid


def field_of(light, resolution=(9, 5, 4), high=(4.0, 2.0, 1.5), bands=2):
    """A field in the open whose band 0 is ``light`` of the positions (P, 3)."""
    field = Field.empty(Grid.from_bounds((0, 0, 0), high, resolution), bands)
    field.depth[..., :2] = lookup.depth_clamp(field.grid) ** np.array([1, 2])
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


def with_gradient(light, slope):
    """A field whose band 0 is ``light`` of the positions, and knows its ``slope`` (P, 3)."""
    field = field_of(light)
    field.gradient[:, :, 0] = slope(field.grid.positions())[..., None]
    return field


def test_quadratic_light_whose_gradient_is_known_is_followed_without_error():
    field = with_gradient(
        lambda p: 9.0 + p[:, 0] ** 2 - p[:, 1] * p[:, 0],
        lambda p: np.stack([2 * p[:, 0] - p[:, 1], -p[:, 0], 0 * p[:, 0]], axis=1),
    )
    assert interpolation_error(field).max() < 1e-5


def test_cubic_light_is_wrong_by_as_much_as_its_third_derivative_says():
    """The estimate is a share of D = h³/12 · f‴ everywhere, and no less than what the lookup gets wrong."""
    a, c, h = 0.3, 50.0, 0.5
    field = with_gradient(
        lambda p: c + a * p[:, 0] ** 3, lambda p: np.stack([3 * a * p[:, 0] ** 2, 0 * p[:, 0], 0 * p[:, 0]], axis=1)
    )
    estimate = interpolation_error(field)
    light = field.coefficients[:, 0, 0].astype(float)
    inner = field.grid.lattice()[:, 0] < 8
    expected = 6 * a * h**3 / 12 / ((light[:-1] + light[1:]) / 2)
    ratio = (estimate[:-1] / expected)[inner[:-1]]
    assert ratio.std() < 0.01 * ratio.mean()
    random = np.random.default_rng(0)
    points = random.uniform((0, 0, 0), (4.0, 2.0, 1.5), (4000, 3))
    found = lookup.irradiance(field, points, np.tile([0.0, 0.0, 1.0], (len(points), 1)))[:, 0]
    exact = (c + a * points[:, 0] ** 3) * 0.28209479177387814 * np.pi
    measured = np.sqrt(((found - exact) ** 2).mean()) / exact.mean()
    assert measured <= np.sqrt((estimate.astype(float) ** 2).mean()) <= 6 * measured


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
