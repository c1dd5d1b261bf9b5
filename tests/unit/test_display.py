# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a picture shows that it has one sample a pixel."""

import numpy as np
import pytest
from gridlight.core.display import standard_view, uneven

pytestmark = pytest.mark.any_version


def test_an_edge_and_what_lies_next_to_it():
    picture = np.zeros((6, 8, 3))
    picture[:, 4:, 1] = 0.1
    np.testing.assert_array_equal(uneven(picture, 0.05).nonzero()[1].reshape(6, 4), [[2, 3, 4, 5]] * 6)
    assert not uneven(picture, 0.15).any()


def test_a_single_pixel():
    picture = np.zeros((7, 9, 3))
    picture[3, 4] = 1.0
    expected = np.zeros((7, 9), bool)
    expected[1:6, 2:7] = True
    expected[[1, 1, 5, 5], [2, 6, 2, 6]] = False
    np.testing.assert_array_equal(uneven(picture, 0.5), expected)


def test_the_standard_view_is_the_srgb_curve_of_exposed_light():
    np.testing.assert_allclose(
        standard_view(np.array([0.0, 0.25, 0.5, 3.0]), 0.0), [0, 0.537099, 0.735357, 1], atol=1e-5
    )
    np.testing.assert_allclose(standard_view(np.array([0.0, 0.125, 0.25]), 1.0), [0, 0.537099, 0.735357], atol=1e-5)
