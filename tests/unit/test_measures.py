# SPDX-License-Identifier: GPL-3.0-or-later
"""Error figures against values worked out by hand."""

import numpy as np
import pytest
from gridlight.core import measures


def test_figures_of_two_points():
    reference = np.array([[3.0, 3.0], [1.0, 1.0]])
    measured = np.array([[3.0, 4.0], [1.0, 0.0]])
    figures = measures.compare(measured, reference)
    scale = np.sqrt(5.0)  # mean of squares (9 + 9 + 1 + 1) / 4
    assert figures.scale == pytest.approx(scale, rel=1e-12)
    assert figures.relative_rms == pytest.approx(np.sqrt(2 / 4) / scale, rel=1e-12)
    assert figures.bias == pytest.approx(0.0, abs=1e-12)
    assert figures.worst == pytest.approx(np.sqrt(1 / 2) / scale, rel=1e-12)
    assert figures.points == 2


def test_bias_is_signed_and_worst_point_is_named():
    reference = np.ones((10, 6, 3))
    measured = reference * 1.1
    measured[7] = 2.0
    figures = measures.compare(measured, reference)
    assert figures.bias == pytest.approx((9 * 0.1 + 1.0) / 10, rel=1e-12)
    assert figures.worst_index == 7
    assert figures.worst == pytest.approx(1.0, rel=1e-12)


def test_a_dark_point_weighs_what_it_is():
    reference = np.array([[1.0], [1e-6]])
    measured = np.array([[1.0], [2e-6]])
    assert measures.compare(measured, reference).relative_rms < 1e-5


def test_scale_from_elsewhere_measures_leaks():
    figures = measures.compare(np.full((4, 1), 0.02), np.zeros((4, 1)), scale=2.0)
    assert figures.relative_rms == pytest.approx(0.01, rel=1e-12)


def test_noise_of_mean_of_two_renders():
    random = np.random.default_rng(1)
    truth, sigma = 2.0, 0.1
    first, second = truth + sigma * random.standard_normal((2, 20000, 1))
    assert measures.noise_of_mean(first, second) == pytest.approx(sigma / np.sqrt(2) / truth, rel=0.02)
    mean_error = measures.compare((first + second) / 2, np.full_like(first, truth)).relative_rms
    assert measures.noise_of_mean(first, second) == pytest.approx(mean_error, rel=0.02)


@pytest.mark.parametrize(
    "measured, reference",
    [(np.zeros((2, 3)), np.zeros((3, 3))), (np.zeros((0, 3)), np.zeros((0, 3))), (np.ones((2, 3)), np.zeros((2, 3)))],
)
def test_what_cannot_be_compared_is_refused(measured, reference):
    with pytest.raises(ValueError):
        measures.compare(measured, reference)


def test_points_have_errors_and_biases_of_their_own():
    errors, biases = measures.point_errors(np.array([[1.0, 3.0], [2.0, 2.0]]), np.full((2, 2), 2.0), scale=2.0)
    np.testing.assert_allclose(errors, [0.5, 0.0])
    np.testing.assert_allclose(biases, [0.0, 0.0])


def test_values_below_zero_are_counted():
    found = measures.count_negative(np.array([[-0.5, 1.0], [0.0, -1.0]]), scale=2.0)
    assert found.as_dict() == {"count": 2, "values": 4, "lowest": -0.5}
    assert measures.count_negative(np.zeros((0, 3)), 1.0).lowest == 0.0
