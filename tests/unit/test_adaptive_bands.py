# SPDX-License-Identifier: GPL-3.0-or-later
"""Bands that are given up: what that costs is what was said, and nothing more could be given up."""

import numpy as np
from gridlight.core.adaptive_bands import band_energy, bands_needed, without_upper_bands
from gridlight.core.path_check import irradiance_of


def sphere(count=4000):
    towards = np.random.default_rng(0).normal(size=(count, 3))
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)


def probes(count=60):
    random = np.random.default_rng(1)
    scale = np.array([1.0] + [0.3] * 3 + [0.1] * 5)
    return (random.normal(size=(count, 9, 3)) * scale[:, None] * random.exponential(1.0, (count, 1, 1))).astype("f4")


def test_energy_is_the_mean_square_of_irradiance_over_all_normals():
    coefficients = probes(5)
    exact = (irradiance_of(coefficients, sphere(60_000)) ** 2).mean(axis=(1, 2))
    np.testing.assert_allclose(band_energy(coefficients).sum(axis=1), exact, rtol=0.02)


def test_what_is_given_up_stays_within_the_budget_and_one_more_would_not():
    coefficients = probes()
    counted = np.ones(len(coefficients), bool)
    for budget in (1e-4, 1e-3, 1e-2, 0.1):
        needed = bands_needed(coefficients, counted, budget)
        kept = without_upper_bands(coefficients, needed)
        energy = band_energy(coefficients)
        lost = sum(energy[row, needed[row] :].sum() for row in range(len(energy))) / len(energy)
        assert lost <= budget
        more = [energy[row, count - 1 :].sum() for row, count in enumerate(needed) if count > 1]
        assert lost + min(more) / len(energy) > budget
        change = irradiance_of(kept, sphere()) - irradiance_of(coefficients, sphere())
        np.testing.assert_allclose((change**2).mean(axis=(1, 2)).mean(), lost, rtol=0.1, atol=1e-9)
    assert (needed >= 1).all()


def test_without_a_budget_nothing_goes_but_what_is_zero():
    coefficients = probes()
    coefficients[3, 4:] = 0.0
    needed = bands_needed(coefficients, np.ones(len(coefficients), bool), 0.0)
    assert needed[3] == 2 and (np.delete(needed, 3) == 3).all()


def test_gradients_lose_the_same_bands():
    gradient = np.ones((2, 9, 3, 3), "f4")
    kept = without_upper_bands(gradient, np.array([1, 3]))
    assert kept[0, 0].all() and not kept[0, 1:].any() and kept[1].all()
