# SPDX-License-Identifier: GPL-3.0-or-later
"""Ringing and the window against it, by closed forms and by brute force over directions."""

import numpy as np
import pytest
from gridlight.core import spherical_harmonics as sh
from gridlight.core.ringing import band_factors, dering, least_irradiance, ringing


def sphere(count=40_000):
    """(count, 3) directions spread evenly: a Fibonacci spiral."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    angle = np.pi * (3 - np.sqrt(5)) * index
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


def beams(count, bands=3, seed=0, ambient=0.0):
    """(count, bands², 3) coefficients of light from single directions, each colour from its own, plus ``ambient``
    radiance."""
    generator = np.random.default_rng(seed)
    direction = generator.normal(size=(count, 3, 3))
    direction /= np.linalg.norm(direction, axis=2, keepdims=True)
    coefficients = sh.basis(direction, bands).transpose(0, 2, 1)
    coefficients[:, 0] += ambient * np.sqrt(4 * np.pi)
    return coefficients


def brute_force(coefficients):
    return sh.irradiance(coefficients[:, None], sphere()).min(axis=1)


def test_a_beam_rings_as_its_kernel_says():
    """E = ¼ + ½ x + 5/32 (3x² − 1) of the cosine x to a beam of unit power: least at x = −8/15."""
    x = -8 / 15
    expected = 1 / 4 + x / 2 + 5 / 32 * (3 * x * x - 1)
    np.testing.assert_allclose(least_irradiance(beams(5)), expected, rtol=1e-7)


@pytest.mark.parametrize("bands", [1, 2, 3, 4])
def test_least_irradiance_is_that_of_all_directions(bands):
    generator = np.random.default_rng(bands)
    coefficients = generator.normal(size=(40, bands * bands, 3))
    found, tried = least_irradiance(coefficients), brute_force(coefficients)
    assert (found <= tried + 1e-9).all()
    np.testing.assert_allclose(found, tried, atol=2e-3 * np.abs(coefficients).max())


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("index", range(9))
def test_single_coefficients(index, sign):
    """The hard cases of the quadratic: no linear part, or one along an eigenvector, or nothing at all."""
    coefficients = np.zeros((1, 9, 3))
    coefficients[0, index] = sign
    np.testing.assert_allclose(least_irradiance(coefficients), brute_force(coefficients), atol=2e-3)
    assert (least_irradiance(np.zeros((2, 9, 3))) == 0).all()


def test_ringing_is_counted_by_probe():
    coefficients = np.concatenate([beams(3), beams(4, ambient=1.0), np.zeros((1, 9, 3))])
    counted = ringing(coefficients)
    assert (counted.probes, counted.negative) == (8, 3)
    x = -8 / 15
    assert counted.lowest == pytest.approx(4 * (1 / 4 + x / 2 + 5 / 32 * (3 * x * x - 1)))  # the mean is ¼
    assert ringing(beams(4, ambient=1.0)).lowest == 0
    assert ringing(np.zeros((0, 9, 3))).as_dict() == {"probes": 0, "negative": 0, "lowest": 0.0}


@pytest.mark.parametrize("bands", [2, 3, 4])
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_window_leaves_nothing_negative_and_takes_no_more_than_it_must(bands, kind):
    coefficients = beams(20, bands, ambient=0.002).astype(kind)
    window = dering(coefficients)
    assert window.coefficients.dtype == kind
    least = least_irradiance(window.coefficients)
    assert (least > -2e-6).all()
    assert (least.min(axis=1) < 1e-5).all()  # a weaker one would not do
    np.testing.assert_array_equal(window.coefficients[:, 0], coefficients[:, 0])
    factors = band_factors(window.factors, bands)
    np.testing.assert_allclose(window.coefficients, coefficients * factors[:, :, None], rtol=1e-5)


def test_no_other_window_damages_less():
    """Of all pairs of factors that do, none changes irradiance less than the one that is found."""
    coefficients = beams(6, seed=3, ambient=0.003)
    power = [np.sum(coefficients[:, l * l : (l + 1) ** 2] ** 2, axis=(1, 2)) for l in (1, 2)]
    lobe = (2 * np.pi / 3) ** 2, (np.pi / 4) ** 2

    def damage(first, second):
        return (1 - first) ** 2 * lobe[0] * power[0] + (1 - second) ** 2 * lobe[1] * power[1]

    found = damage(*dering(coefficients).factors.T)
    grid = np.linspace(0.02, 1, 50)
    for first in grid:
        for second in grid:
            scaled = coefficients * band_factors(np.tile([first, second], (6, 1)), 3)[:, :, None]
            does = (least_irradiance(scaled) >= 0).all(axis=1)
            assert (damage(first, second)[does] >= 0.99 * found[does]).all()


def test_what_does_not_ring_is_not_touched():
    coefficients = np.concatenate([beams(3, ambient=1.0), beams(1)])
    window = dering(coefficients)
    np.testing.assert_array_equal(window.coefficients[:3], coefficients[:3])
    np.testing.assert_array_equal((window.factors < 1).any(axis=1), [False] * 3 + [True])
    summary = window.as_dict()
    assert summary["windowed"] == 1 and summary["probes"] == 4


def test_damage_is_the_change_of_irradiance():
    """Of one beam, the same for all colours, it is what a search over both factors finds on the closed form: 10.6 %."""
    coefficients = np.repeat(beams(6)[..., :1], 3, axis=2)
    window = dering(coefficients)
    before, after = (sh.irradiance(c[:, None], sphere()) for c in (coefficients, window.coefficients))
    expected = np.sqrt(((after - before) ** 2).mean() / (before**2).mean())
    assert window.damage == pytest.approx(expected, rel=1e-3)
    assert window.damage == pytest.approx(0.106, abs=0.002)


def test_negative_light_is_beyond_a_window():
    coefficients = -beams(2)
    window = dering(coefficients)
    np.testing.assert_array_equal(window.coefficients, coefficients)
    assert ringing(coefficients).negative == 2


def test_radiance_of_any_size():
    """Suns and starlight: windows depend on the shape of the light alone."""
    coefficients = beams(5)
    factors = dering(coefficients).factors
    for scale in (1e-30, 1e30):
        np.testing.assert_allclose(dering(scale * coefficients).factors, factors, rtol=1e-4)


@pytest.mark.parametrize("seed", range(4))
def test_no_ringing_probe_escapes_the_quick_test(seed):
    """Light of every shape, from far below to far above where it starts to ring."""
    generator = np.random.default_rng(seed)
    coefficients = generator.normal(size=(3000, 9, 3))
    coefficients[:, 0] = generator.uniform(0, 4, (3000, 1))
    exact = least_irradiance(coefficients) < -1e-6 * coefficients[:, 0] * np.sqrt(np.pi) / 2
    assert 100 < exact.any(axis=1).sum() < 2999
    assert ringing(coefficients).negative == exact.any(axis=1).sum()


@pytest.mark.parametrize("direction", [(1.0, 0, 0), (0.6, 0, 0.8), (0.48, 0.64, 0.6)])
def test_the_quick_test_knows_zonal_light(direction):
    """−(3x² − 1) has the least eigenvalue that its norm allows: the quick test is tight there."""
    coefficients = np.zeros((2, 9, 3))
    coefficients[:, 4:] = -sh.basis(np.array(direction), 3)[4:, None]
    lowest = sh.irradiance(coefficients[0], np.array(direction))[0]
    coefficients[:, 0] = np.array([0.999, 1.001])[:, None] * -lowest / (np.pi * 0.28209479177387814)
    assert ringing(coefficients).negative == 1
    assert ringing(coefficients[1:]).negative == 0
