# SPDX-License-Identifier: GPL-3.0-or-later
"""Ringing: where irradiance of a truncated series falls below zero, and the window that takes it away at least cost.

Irradiance of radiance coefficients is a quadratic function on the unit sphere, because the cosine lobe ends with the
third band: E(n) = c + b·n + nᵀ M n. Its minimum is found exactly, by the Lagrangian dual of the trust-region problem
(Sorensen, "Newton's Method with a Model Trust Region Modification", SINUM 1982), in which strong duality holds::

    min E = c + max over t ≥ 0 of  w₀ − t − Σ βᵢ² / 4(wᵢ − w₀ + t)        w ascending eigenvalues of M, β = Vᵀ b

A window scales whole bands (core/windowing.py), here probe by probe (Sloan, "Deringing Spherical Harmonics", SIGGRAPH
Asia 2017). Mean light stays, contrast is lost. Windows with one parameter lose far more of it than they must: for light
from a single direction irradiance changes by 49 % of its RMS with Hanning's window, by 42 % with the Laplacian's, by
11 % with the best factors for the two bands. Those are sought here: the factors that leave no direction below zero form
a convex set, and the damage is a distance from (1, 1).
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from .conventions import COSINE_LOBE, MAX_BANDS, band_of, bands_of
from .spherical_harmonics import Y0, Y1, Y2_XX, Y2_ZZ, cosine_lobe

_HALVINGS = 28  # of the dual's interval: the minimum is off by its square
_GOLDEN = (np.sqrt(5) - 1) / 2
_GOLDEN_STEPS = 10  # shrink an interval to 1/120; about the least damage the ratio hardly matters
_FACTOR_HALVINGS = 17  # factors are exact to 1e-5
_PROBES_AT_ONCE = 1 << 14
_ROUNDING = 1e-6  # of the mean irradiance: less below zero than this is float32
_COUNTED = 1e-5  # what is reported: windows leave as much as their factors are exact


@dataclass(frozen=True)
class Ringing:
    """Where irradiance is negative. N probes are counted, each in all directions."""

    probes: int  # N
    negative: int  # probes with a direction in which some channel is below zero
    lowest: float  # most negative irradiance over the mean irradiance of its own probe and channel; 0 where none is

    def as_dict(self) -> dict:
        """Plain values for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class Window:
    """What a window did. ``factors`` (N, 2) belong to bands 1 and 2; 1 where a probe was left alone."""

    coefficients: np.ndarray  # (N, K, 3) like those given
    factors: np.ndarray
    damage: float  # RMS change of irradiance over all directions, relative to its RMS, over all N probes

    def as_dict(self) -> dict:
        """Plain values for JSON."""
        return {
            "probes": len(self.factors),
            "windowed": int((self.factors < 1).any(axis=1).sum()),
            "least_factor": float(self.factors.min(initial=1.0)),
            "damage": self.damage,
        }


def least_irradiance(coefficients: np.ndarray) -> np.ndarray:
    """(N, 3) exact minimum over all directions of the irradiance of radiance ``coefficients`` (N, K, 3)."""
    return _Quadratic.of(np.asarray(coefficients, float)).minimum(np.ones((len(coefficients), 2)))


def ringing(coefficients: np.ndarray) -> Ringing:
    """Counts the probes of ``coefficients`` (N, K, 3) whose irradiance is negative somewhere."""
    negative, lowest = 0, 0.0
    for start in range(0, len(coefficients), _PROBES_AT_ONCE):
        part = np.asarray(coefficients[start : start + _PROBES_AT_ONCE], float)
        mean = _mean_irradiance(part)
        may = np.flatnonzero(_may_ring(part))
        below = _relative_minimum(part[may], mean[may])
        rings = (below < -_COUNTED) | (mean[may] < 0)
        negative += int(rings.any(axis=1).sum())
        lowest = min(lowest, float(below[rings].min(initial=0.0)))
    return Ringing(len(coefficients), negative, lowest)


def dering(coefficients: np.ndarray) -> Window:
    """The window that leaves no irradiance of radiance ``coefficients`` (N, K, 3) negative and changes it least.

    Probes that do not ring are not touched. The three channels of a probe share its factors, so that hues stay.
    Channels whose mean is negative, as lamps of negative power make them, are beyond a window and do not count.
    """
    original = np.asarray(coefficients, float)
    factors = np.ones((len(original), 2))
    mean = _mean_irradiance(original)
    rings = np.flatnonzero(_may_ring(original))
    rings = rings[(_relative_minimum(original[rings], mean[rings]) < -_ROUNDING).any(axis=1)]
    for start in range(0, len(rings), _PROBES_AT_ONCE):
        part = rings[start : start + _PROBES_AT_ONCE]
        factors[part] = _least_damage(original[part], np.where(mean[part] > 0, -_ROUNDING * mean[part], -np.inf))
    bands = bands_of(original.shape[1])
    windowed = original * band_factors(factors, bands)[:, :, None]
    return Window(windowed.astype(np.asarray(coefficients).dtype), factors, _damage(original, windowed))


def _relative_minimum(coefficients: np.ndarray, mean: np.ndarray) -> np.ndarray:
    """(N, 3) least irradiance over the ``mean`` (N, 3); 0 where that is not positive."""
    return np.where(mean > 0, least_irradiance(coefficients) / np.where(mean > 0, mean, 1.0), 0.0)


def _may_ring(coefficients: np.ndarray) -> np.ndarray:
    """(N,) bool: false where the norms of the bands leave no room for a negative direction. The least eigenvalue of a
    traceless symmetric M is not below −√⅔ |M|."""
    first = np.sqrt((coefficients[:, 1:4] ** 2).sum(axis=1)) * (COSINE_LOBE[1] * Y1)
    # a unit coefficient of the third band is a matrix of Frobenius norm ½ √(15/2π)
    second = np.sqrt((coefficients[:, 4:9] ** 2).sum(axis=1)) * (COSINE_LOBE[2] * np.sqrt(15 / (2 * np.pi)) / 2)
    return (_mean_irradiance(coefficients) < first + np.sqrt(2 / 3) * second).any(axis=1)


def band_factors(factors: np.ndarray, bands: int) -> np.ndarray:
    """(N, bands²) factors of all coefficients from those of bands 1 and 2, (N, 2). The fourth band, which irradiance
    does not hold, goes on falling as the two before."""
    first, second = factors.T
    falls_on = second * np.minimum(second / np.where(first > 0, first, 1.0), 1.0)
    by_band = np.stack([np.ones_like(first), first, second, falls_on], axis=1)
    return by_band[:, [band_of(index) for index in range(bands * bands)]]


def _least_damage(coefficients: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """(N, 2) factors with least damage under which irradiance stays above ``limit`` (N, 3), by golden section over the
    ratio in which the two bands are taken back; along each ratio, no more than needed."""
    quadratic = _Quadratic.of(coefficients)
    power = np.stack(
        [np.sum((COSINE_LOBE[l] * coefficients[:, l * l : (l + 1) ** 2]) ** 2, axis=(1, 2)) for l in (1, 2)], axis=1
    )

    def best_along(ratio):
        """Factors, and the squared damage; where no window of this ratio does, a value that falls towards ½, which
        takes both bands back alike and always does."""
        step = np.minimum(np.stack([2 * ratio, 2 - 2 * ratio], axis=1), 1.0)
        low, high = np.zeros(len(ratio)), np.ones(len(ratio))
        does = (quadratic.minimum(1 - step) >= limit).all(axis=1)
        for _ in range(_FACTOR_HALVINGS):
            middle = (low + high) / 2
            good = (quadratic.minimum(1 - middle[:, None] * step) >= limit).all(axis=1)
            low, high = np.where(good, low, middle), np.where(good, middle, high)
        factors = 1 - high[:, None] * step
        cost = ((1 - factors) ** 2 * power).sum(axis=1)
        return factors, np.where(does, cost, (1 + np.abs(ratio - 0.5)) * power.sum(axis=1))

    low, high = np.zeros(len(coefficients)), np.ones(len(coefficients))
    left, right = 1 - _GOLDEN + low, _GOLDEN + low
    left_cost, right_cost = best_along(left)[1], best_along(right)[1]
    for _ in range(_GOLDEN_STEPS):
        good = left_cost <= right_cost
        low, high = np.where(good, low, left), np.where(good, right, high)
        kept, kept_cost = np.where(good, left, right), np.where(good, left_cost, right_cost)
        fresh = low + high - kept
        fresh_cost = best_along(fresh)[1]
        below = fresh < kept
        left, right = np.where(below, fresh, kept), np.where(below, kept, fresh)
        left_cost, right_cost = np.where(below, fresh_cost, kept_cost), np.where(below, kept_cost, fresh_cost)
    return best_along(np.where(left_cost <= right_cost, left, right))[0]


def _mean_irradiance(coefficients: np.ndarray) -> np.ndarray:
    """(N, 3) over all directions."""
    return coefficients[:, 0] * (COSINE_LOBE[0] * Y0)


def _damage(before: np.ndarray, after: np.ndarray) -> float:
    """By Parseval: the integral of squared irradiance is the sum of its squared coefficients."""
    lobe = cosine_lobe(bands_of(before.shape[1]))[:, None]
    scale = np.sqrt(np.sum((lobe * before) ** 2))
    return float(np.sqrt(np.sum((lobe * (after - before)) ** 2)) / scale) if scale > 0 else 0.0


@dataclass(frozen=True)
class _Quadratic:
    """Irradiance of N probes and 3 channels in the frame of its quadratic part."""

    constant: np.ndarray  # (N, 3)
    linear: np.ndarray  # (N, 3, 3): β per channel
    eigenvalues: np.ndarray  # (N, 3, 3): w per channel, ascending

    @classmethod
    def of(cls, coefficients: np.ndarray) -> _Quadratic:
        count = len(coefficients)
        values = np.zeros((count, MAX_BANDS**2, 3))
        values[:, : coefficients.shape[1]] = coefficients
        values = values.transpose(0, 2, 1)  # (N, channel, coefficient)
        linear = Y1 * COSINE_LOBE[1] * values[..., [3, 1, 2]]
        xy, yz, zz, xz, xx = np.moveaxis(COSINE_LOBE[2] * values[..., 4:9], -1, 0)
        matrix = np.zeros((count, 3, 3, 3))
        matrix[..., 0, 1] = matrix[..., 1, 0] = Y2_XX * xy
        matrix[..., 1, 2] = matrix[..., 2, 1] = Y2_XX * yz
        matrix[..., 0, 2] = matrix[..., 2, 0] = Y2_XX * xz
        matrix[..., 0, 0] = Y2_XX * xx - Y2_ZZ * zz
        matrix[..., 1, 1] = -Y2_XX * xx - Y2_ZZ * zz
        matrix[..., 2, 2] = 2 * Y2_ZZ * zz
        eigenvalues, vectors = np.linalg.eigh(matrix)
        return cls(_mean_irradiance(coefficients), np.einsum("ncij,nci->ncj", vectors, linear), eigenvalues)

    def minimum(self, factors: np.ndarray) -> np.ndarray:
        """(N, 3) least value on the unit sphere with bands 1 and 2 scaled by ``factors`` (N, 2)."""
        squared = (self.linear * factors[:, 0, None, None]) ** 2
        eigenvalues = self.eigenvalues * factors[:, 1, None, None]
        gap = eigenvalues - eigenvalues[..., :1]
        # Σ βᵢ² / 4(gapᵢ + t)² falls with t and is below 1 from |β|/2 on: the dual's maximum lies where it is 1.
        low, high = np.zeros(squared.shape[:2]), np.sqrt(squared.sum(axis=-1)) / 2
        for _ in range(_HALVINGS):
            middle = (low + high) / 2
            steep = _sum_of_ratios(squared, gap + middle[..., None], 2) > 4
            low, high = np.where(steep, middle, low), np.where(steep, high, middle)
        dual = eigenvalues[..., 0] - high - _sum_of_ratios(squared, gap + high[..., None], 1) / 4
        return self.constant + dual


def _sum_of_ratios(numerator: np.ndarray, denominator: np.ndarray, power: int) -> np.ndarray:
    """Σ numerator / denominator^power over the last axis; terms without a numerator are 0."""
    present = numerator > 0
    return (np.where(present, numerator, 0.0) / np.where(present, denominator, 1.0) ** power).sum(axis=-1)
