# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows against their formulas, and the least strength against the light it has to tame."""

import numpy as np
import pytest
from gridlight.core import spherical_harmonics as sh
from gridlight.core import windowing

FIBONACCI = np.arange(2000) + 0.5
POLAR, ROUND = np.arccos(1 - 2 * FIBONACCI / 2000), np.pi * (1 + 5**0.5) * FIBONACCI
SPHERE = np.stack([np.sin(POLAR) * np.cos(ROUND), np.sin(POLAR) * np.sin(ROUND), np.cos(POLAR)], axis=1)


def distant_light(direction, bands=3):
    """Coefficients (bands², 3) of a light that is a point on the sphere: the strongest ringing there is."""
    return sh.basis(np.array(direction, float), bands)[:, None] * np.array([1.0, 0.5, 0.25])


def test_windows_are_their_formulas():
    np.testing.assert_allclose(windowing.hann(4, 4), [1, 0.5 + 0.5**1.5, 0.5, 0.5 - 0.5**1.5], atol=1e-15)
    np.testing.assert_allclose(windowing.hann(4, 2), [1, 0.5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(windowing.lanczos(3, 2), [1, 2 / np.pi, 0], atol=1e-15)
    np.testing.assert_allclose(windowing.regularisation(3, 0.5), [1, 1 / 3, 1 / 19], atol=1e-15)


def test_a_window_scales_whole_bands():
    scaled = windowing.apply(np.ones((2, 9, 3)), np.array([[1, 0.5, 0.25], [1, 1, 0]]))
    assert np.array_equal(scaled[0, :, 0], [1] + [0.5] * 3 + [0.25] * 5)
    assert np.array_equal(scaled[1, :, 2], [1] * 4 + [0] * 5)


@pytest.mark.parametrize("bands", [2, 3, 4])
def test_least_strength_is_enough_and_not_more(bands):
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(20, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    light = np.stack([distant_light(direction, bands) for direction in directions])
    before = sh.irradiance(light[:, None], SPHERE[None])
    assert (before.min(axis=(1, 2)) < 0).all(), "the test's light does not ring"
    strength = windowing.least_strength(light)
    peak = before.max(axis=(1, 2))
    after = sh.irradiance(windowing.apply(light, windowing.regularisation(bands, strength))[:, None], SPHERE[None])
    assert (after.min(axis=(1, 2)) > -5e-3 * peak).all()
    weaker = sh.irradiance(windowing.apply(light, windowing.regularisation(bands, strength * 0.8))[:, None], SPHERE)
    assert (weaker.min(axis=(1, 2)) < 0).all()


def test_light_that_does_not_ring_is_left_alone():
    soft = np.zeros((3, 9, 3))
    soft[:, 0] = 1.0
    soft[1, 1:4] = 0.1
    assert np.array_equal(windowing.least_strength(soft), np.zeros(3))
