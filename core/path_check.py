# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a bake is from what paths find at some of its places, without being fooled by the paths' own noise.

Two sets of paths that know nothing of each other give two estimates a and b of the true irradiance t at every place.
For baked values m, which know nothing of either,

    E[(m − a)(m − b)] = (m − t)²

because the errors of a and b average out of the product. The mean over places, normals and colours is the bake's
squared error, with everything in it that a bake can get wrong: noise, texels, patches, missing bounces, bands. It may
come out below zero where the error is smaller than the paths can tell.

All pairs of SETS sets are used (a U-statistic): of the same paths, halves would leave a third more noise. If each set
is off by variance s² and the bake by e, the mean over pairs varies by 2 s⁴ / S(S−1) + 4 s² e² / S.

Where few places make most of the error, those that are drawn more often miss them than not, and say too little. What is
left to chance by drawing counts the more for that the skewer the places are, as in Hall's bound of a mean ("On the
Removal of Skewness by Transformation", J. R. Statist. Soc. B 54, 1992; its first term at one standard error).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import spherical_harmonics as sh
from .conventions import bands_of

NORMALS = np.concatenate([np.eye(3), -np.eye(3)])
MOST_BANDS = 3  # that irradiance has
SETS = 8
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
    """Light at K places by SETS sets of paths: irradiance for ``normals`` (N, 3) and coefficients of three bands.

    ``drawn_from``: how many places the K were drawn from, if those are all that the error is asked for: the more of
    them were drawn, the less is left to chance.
    """

    def __init__(self, count: int, normals: np.ndarray = NORMALS, drawn_from: int | None = None):
        self._normals = normals
        self._left_out = 1.0 if drawn_from is None else 1.0 - count / max(drawn_from, count)
        self._irradiance = np.zeros((SETS, count, len(normals), 3))  # sums
        self._coefficients = np.zeros((SETS, count, MOST_BANDS**2, 3))
        self.paths = 0  # of each place and set

    def add(self, directions: np.ndarray, flux: np.ndarray, paths: int) -> None:
        """Adds samples (SETS, K, S, 3) of ``paths`` more paths of each place and set, see ProbePaths.trace."""
        step = max(1, _PLACES_AT_ONCE // directions.shape[2])
        for half in range(SETS):
            for first in range(0, directions.shape[1], step):
                part = half, slice(first, first + step)
                towards = directions[part].astype(float)
                lobes = np.maximum(towards @ self._normals.T, 0.0)
                basis = sh.basis(towards, MOST_BANDS)
                self._irradiance[part] += lobes.swapaxes(1, 2) @ flux[part]
                self._coefficients[part] += basis.swapaxes(1, 2) @ flux[part]
        self.paths += paths

    @property
    def irradiance(self) -> np.ndarray:
        """(SETS, K, N, 3) by each set."""
        return self._irradiance / max(self.paths, 1)

    @property
    def scale(self) -> float:
        """Mean square of the irradiance; 0 in the dark."""
        return float(max(_pairs(self.irradiance).mean(), 0.0))

    def error(self, measured: np.ndarray) -> SquaredError:
        """Of ``measured`` (K, N, 3) irradiance."""
        return self._statistics(measured - self.irradiance)

    def floor(self, bands: int) -> SquaredError:
        """What is lost if nothing is but the bands above ``bands``."""
        return self._statistics(self.irradiance - self._in_bands(bands))

    def error_in_bands(self, coefficients: np.ndarray) -> SquaredError:
        """Of ``coefficients`` (K, bands², 3) where their bands can say it: the floor is not in it."""
        bands = bands_of(coefficients.shape[1])
        measured = irradiance_of(coefficients, self._normals)
        return self._statistics(measured - self._in_bands(min(bands, MOST_BANDS)))

    def _in_bands(self, bands: int) -> np.ndarray:
        return irradiance_of(self._coefficients[:, :, : bands**2] / max(self.paths, 1), self._normals)

    def _statistics(self, deviations: np.ndarray) -> SquaredError:
        """Of the products of (SETS, K, N, 3) ``deviations`` by all pairs of sets."""
        places = _pairs(deviations).mean(axis=(1, 2))
        scale = max(self.scale, 1e-300)
        count = len(places)
        variance = deviations.var(axis=0, ddof=1).mean(axis=(1, 2))  # of one set's values
        of_pairs = 2 * variance**2 / (SETS * (SETS - 1)) + 4 / SETS * variance * max(places.mean(), 0.0)
        # Values of one place are not independent: they count as one of each colour.
        noise = np.sqrt(of_pairs.mean() / (3 * count))
        spread = places.std(ddof=1) / np.sqrt(count) if count > 1 else abs(places).max(initial=0.0)
        wider = 1.0 + max(_skewness(places), 0.0) / (2 * np.sqrt(count))
        deviation = np.sqrt(noise**2 + self._left_out * wider**2 * max(spread**2 - noise**2, 0.0))
        return SquaredError(float(places.mean() / scale), float(deviation / scale), float(noise / scale))


def _pairs(values: np.ndarray) -> np.ndarray:
    """Mean of the products of all pairs of ``values`` (SETS, …) by different sets."""
    return (values.sum(axis=0) ** 2 - (values**2).sum(axis=0)) / (SETS * (SETS - 1))


def _skewness(values: np.ndarray) -> float:
    """Of (K,) values; 0 where they are all alike."""
    apart = values - values.mean()
    spread = np.sqrt((apart**2).mean())
    return float((apart**3).mean() / spread**3) if spread > 0 else 0.0


def irradiance_of(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(…, N, 3) irradiance for ``normals`` (N, 3) by ``coefficients`` (…, bands², 3)."""
    return sh.irradiance(np.asarray(coefficients, float)[..., None, :, :], normals)
