# SPDX-License-Identifier: GPL-3.0-or-later
"""The check by paths against light that is known: its estimate must be the error, however noisy the paths are."""

import numpy as np
import pytest
from gridlight.core import spherical_harmonics as sh
from gridlight.core.path_check import NORMALS, SETS, PathCheck, irradiance_of

PLACES = 40


def directions_of(count, random):
    towards = random.normal(size=(PLACES, count, 3))
    return towards / np.linalg.norm(towards, axis=-1, keepdims=True)


def check_of(radiance, paths, noise, seed=0, drawn_from=None):
    """A check of places that see ``radiance`` (directions → (…, 3)) by paths whose values are off at random."""
    random = np.random.default_rng(seed)
    check = PathCheck(PLACES, drawn_from=drawn_from)
    each = max(paths * 2 // SETS, 1)
    towards = np.stack([directions_of(each, random) for _ in range(SETS)])
    flux = 4 * np.pi * radiance(towards) * random.exponential(1.0, (*towards.shape[:3], 1)) ** noise
    mean = random.exponential(1.0, 100_000) ** noise
    check.add(towards, flux / mean.mean(), each)
    return check


def lobe(towards):
    """Radiance within three bands, whose irradiance is exact."""
    return np.repeat(1.0 + 0.5 * towards[..., 2:] + 0.3 * (3 * towards[..., :1] ** 2 - 1), 3, axis=-1)


def coefficients_of(radiance, bands=3):
    random = np.random.default_rng(9)
    towards = random.normal(size=(400_000, 3))
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    return np.einsum("sb,sc->bc", sh.basis(towards, bands), radiance(towards)) * (4 * np.pi / len(towards))


@pytest.mark.parametrize("wrong", [0.0, 0.02, 0.1])
def test_the_error_of_what_is_baked_is_found_in_noise_that_is_larger(wrong):
    exact = irradiance_of(np.broadcast_to(coefficients_of(lobe), (PLACES, 9, 3)), NORMALS)
    random = np.random.default_rng(5)
    measured = exact + wrong * np.sqrt((exact**2).mean()) * random.choice([-1.0, 1.0], exact.shape)
    found = check_of(lobe, 4000, 1).error(measured)
    assert abs(found.value - wrong**2) <= 4 * max(found.deviation, found.noise)
    assert found.deviation < 0.25 * max(wrong, 0.03) ** 2


def test_paths_that_are_few_say_that_they_do_not_know():
    exact = irradiance_of(np.broadcast_to(coefficients_of(lobe), (PLACES, 9, 3)), NORMALS)
    few, many = (check_of(lobe, paths, 1).error(exact) for paths in (50, 3200))
    assert few.noise > 20 * many.noise
    assert few.bound() > many.bound()


def test_the_noise_that_is_told_is_the_noise_there_is():
    """The spread of the estimate over forty checks by other paths; of an exact bake, and of one that errs."""
    exact = irradiance_of(np.broadcast_to(coefficients_of(lobe), (PLACES, 9, 3)), NORMALS)
    for factor in (1.0, 1.1):
        found = [check_of(lobe, 200, 1, seed).error(factor * exact) for seed in range(40)]
        spread = np.std([error.value for error in found], ddof=1)
        # one colour here, three of the same in the estimate, and normals that look the same way: within a factor of 3
        assert spread / 3 < np.mean([error.noise for error in found]) < 3 * spread


def test_of_all_places_only_the_noise_is_left_to_chance():
    """A bake that errs in some places: how much, is known by the places that were checked, if those are all."""
    exact = irradiance_of(np.broadcast_to(coefficients_of(lobe), (PLACES, 9, 3)), NORMALS)
    wrong = exact * np.where(np.arange(PLACES) % 8 == 0, 1.5, 1.0)[:, None, None]
    some, half, every = (check_of(lobe, 1000, 1, drawn_from=of).error(wrong) for of in (None, 2 * PLACES, PLACES))
    assert some.value == half.value == every.value
    assert every.deviation == pytest.approx(every.noise)
    assert half.deviation**2 - half.noise**2 == pytest.approx(0.5 * (some.deviation**2 - some.noise**2))
    assert some.deviation > 3 * every.deviation


def test_the_bound_holds_where_few_places_make_most_of_the_error():
    """Draws of 64 places of a population whose errors are spread over orders of magnitude. One standard error above the
    mean is where a mean of many would be below in 84 % of all draws."""
    random = np.random.default_rng(3)
    population = np.exp(0.5 * random.normal(size=6000))
    held = []
    for _ in range(1500):
        drawn = random.choice(population, 64, replace=False)
        check = PathCheck(64)
        check.paths, check._irradiance[:] = 1, 1.0
        found = check._statistics(np.broadcast_to(drawn[:, None, None], check._irradiance.shape))
        held.append(found.value + found.deviation >= (population**2).mean())
    assert np.mean(held) > 0.77  # 0.79; 0.75 without the skewness


def test_the_floor_is_what_bands_cannot_say():
    """A cap of light: its irradiance against that of its own three bands, both by a fine sum."""

    def cap(towards):
        return np.repeat((towards[..., 2:] > 0.9).astype(float), 3, axis=-1)

    random = np.random.default_rng(3)
    towards = random.normal(size=(400_000, 3))
    towards /= np.linalg.norm(towards, axis=-1, keepdims=True)
    lobes = np.maximum(towards @ NORMALS.T, 0)
    exact = np.einsum("sn,sc->nc", lobes, cap(towards)) * (4 * np.pi / len(towards))
    for bands in (1, 2, 3):
        kept = irradiance_of(coefficients_of(cap, bands), NORMALS)
        expected = np.sqrt(((kept - exact) ** 2).mean() / (exact**2).mean())
        found = check_of(cap, 4000, 0).floor(bands)
        assert abs(found.estimate - expected) < 0.1 * expected + 0.005


def test_an_error_outside_the_bands_is_none_within_them():
    def cap(towards):
        return np.repeat((towards[..., 2:] > 0.9).astype(float), 3, axis=-1)

    check = check_of(cap, 4000, 0)
    baked = np.broadcast_to(coefficients_of(cap), (PLACES, 9, 3))
    within, all_of_it = check.error_in_bands(baked), check.error(irradiance_of(baked, NORMALS))
    assert abs(within.value) < 3 * within.noise < all_of_it.value
