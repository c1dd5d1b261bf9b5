# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a bake is from what paths find at some of its places, without being fooled by the paths' own noise.

Two sets of paths that know nothing of each other give two estimates a and b of the true irradiance t at every place.
For baked values m, which know nothing of either,

    E[(m − a)(m − b)] = (m − t)²

because the errors of a and b average out of the product. The mean over places, normals and colours is the bake's
squared error, with everything in it that a bake can get wrong: noise, texels, patches, missing bounces, bands. It may
come out below zero where the error is smaller than the paths can tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import spherical_harmonics as sh
from .conventions import bands_of

NORMALS = np.concatenate([np.eye(3), -np.eye(3)])
MOST_BANDS = 3  # that irradiance has
_PLACES_AT_ONCE = 1 << 18  # samples


@dataclass(frozen=True)
class SquaredError:
    """Mean squared error relative to the mean square of the light, and its standard error by the spread between
    places; ``noise`` is the part of that which more paths would take away."""

    value: float
    deviation: float
    noise: float

    @property
    def estimate(self) -> float:
        """Relative RMS error."""
        return float(np.sqrt(max(self.value, 0.0)))

    def bound(self, deviations: float = 1.0) -> float:
        """Relative RMS error that is not exceeded but by chance, that many ``deviations`` above the estimate."""
        return float(np.sqrt(max(self.value, 0.0) + deviations * self.deviation))


class PathCheck:
    """Light at K places by two sets of paths: irradiance for ``normals`` (N, 3) and coefficients of three bands."""

    def __init__(self, count: int, normals: np.ndarray = NORMALS):
        self._normals = normals
        self._irradiance = np.zeros((2, count, len(normals), 3))  # sums
        self._coefficients = np.zeros((2, count, MOST_BANDS**2, 3))
        self.paths = 0  # of each place and set

    def add(self, half: int, directions: np.ndarray, flux: np.ndarray) -> None:
        """Adds samples (K, S, 3) of set ``half``, see ProbePaths.trace."""
        step = max(1, _PLACES_AT_ONCE // directions.shape[1])
        for first in range(0, len(directions), step):
            part = slice(first, first + step)
            towards = directions[part].astype(float)
            lobes = np.maximum(towards @ self._normals.T, 0.0)
            basis = sh.basis(towards, MOST_BANDS)
            self._irradiance[half, part] += np.einsum("ksn,ksc->knc", lobes, flux[part])
            self._coefficients[half, part] += np.einsum("ksb,ksc->kbc", basis, flux[part])

    @property
    def irradiance(self) -> np.ndarray:
        """(2, K, N, 3) by each set."""
        return self._irradiance / max(self.paths, 1)

    @property
    def scale(self) -> float:
        """Mean square of the irradiance; 0 in the dark."""
        first, second = self.irradiance
        return float(max((first * second).mean(), 0.0))

    def error(self, measured: np.ndarray) -> SquaredError:
        """Of ``measured`` (K, N, 3) irradiance."""
        first, second = self.irradiance
        return self._product(measured - first, measured - second)

    def floor(self, bands: int) -> SquaredError:
        """What is lost if nothing is but the bands above ``bands``."""
        first, second = self.irradiance - self._in_bands(bands)
        return self._product(first, second)

    def error_in_bands(self, coefficients: np.ndarray) -> SquaredError:
        """Of ``coefficients`` (K, bands², 3) where their bands can say it: the floor is not in it."""
        bands = bands_of(coefficients.shape[1])
        measured = irradiance_of(coefficients, self._normals)
        first, second = self._in_bands(min(bands, MOST_BANDS))
        return self._product(measured - first, measured - second)

    def _in_bands(self, bands: int) -> np.ndarray:
        return irradiance_of(self._coefficients[:, :, : bands**2] / max(self.paths, 1), self._normals)

    def _product(self, first: np.ndarray, second: np.ndarray) -> SquaredError:
        """Statistics of the product of (K, N, 3) deviations by both sets."""
        places = (first * second).mean(axis=(1, 2))
        scale = max(self.scale, 1e-300)
        count = len(places)
        deviation = places.std(ddof=1) / np.sqrt(count) if count > 1 else abs(places).max(initial=0.0)
        half = (0.5 * (first - second) ** 2).mean(axis=(1, 2))  # variance of one set's values
        # Values of one place are not independent: they count as one of each colour.
        noise = np.sqrt(((half**2).mean() + 2 * half.mean() * max(places.mean(), 0.0)) / (3 * count))
        return SquaredError(float(places.mean() / scale), float(deviation / scale), float(noise / scale))


def irradiance_of(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(…, N, 3) irradiance for ``normals`` (N, 3) by ``coefficients`` (…, bands², 3)."""
    return sh.irradiance(np.asarray(coefficients, float)[..., None, :, :], normals)
