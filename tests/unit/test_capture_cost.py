# SPDX-License-Identifier: GPL-3.0-or-later
"""The model of what captures cost: it finds the rates that timings were made with, and its crossover is a step."""

import math

import pytest
from gridlight.core.capture_cost import FEW, MANY, MOST, CaptureCost, Timings

RATES = CaptureCost(
    raster_fixed=2e-4, raster_texel=3e-8, raster_triangle=4e-8, trace_fixed=5e-5, trace_texel=6e-8, trace_level=5e-9
)


def timings_of(cost, face=16, probes=64):
    return Timings(
        face,
        probes,
        *(cost.raster(*case, face) for case in ((1, FEW), (probes, FEW), (probes, MANY))),
        *(cost.trace(*case, face) for case in ((1, FEW), (probes, FEW), (probes, MANY))),
    )


def test_rates_are_found_again():
    found = CaptureCost.fitted(timings_of(RATES))
    for name, value in vars(RATES).items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-9, abs=1e-12), name


@pytest.mark.parametrize(("probes", "face"), [(300, 12), (300, 16), (30_000, 32)])
def test_crossover_is_the_power_of_two_nearest_to_where_both_cost_the_same(probes, face):
    low, high = 4.0, float(MOST)
    for _ in range(100):
        middle = math.sqrt(low * high)
        if RATES.raster(probes, middle, face) < RATES.trace(probes, middle, face):
            low = middle
        else:
            high = middle
    assert RATES.crossover(probes, face) == 2 ** round(math.log2(low))


def test_timings_that_differ_by_noise_give_the_same_choice():
    """Ten per cent either way: the step hides it unless the true crossover lies near a step's edge."""
    steps = {
        CaptureCost.fitted(
            Timings(
                **{
                    name: value * (factor if isinstance(value, float) else 1)
                    for name, value in vars(timings_of(RATES)).items()
                }
            )
        ).crossover(300, 16)
        for factor in (0.9, 1.0, 1.1)
    }
    assert steps == {RATES.crossover(300, 16)}


def test_one_way_may_always_be_cheaper():
    free_rays = CaptureCost(1e-3, 1e-6, 1e-6, 0.0, 1e-12, 0.0)
    assert free_rays.crossover(100, 16) == 0
    no_rays = CaptureCost(0.0, 1e-12, 1e-15, 1.0, 1e-3, 1e-3)
    assert no_rays.crossover(100, 16) == MOST


def test_noise_makes_no_negative_rates():
    cost = CaptureCost.fitted(Timings(16, 8, 2e-3, 1e-3, 5e-4, 2e-3, 1e-3, 5e-4))
    assert min(vars(cost).values()) >= 0


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf, None, "fast"])
def test_values_that_are_no_timings_are_refused(bad):
    with pytest.raises((ValueError, TypeError)):
        Timings(**{**vars(timings_of(RATES)), "trace_few": bad})
