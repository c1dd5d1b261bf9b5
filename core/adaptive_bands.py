# SPDX-License-Identifier: GPL-3.0-or-later
"""Fewer bands for probes whose upper bands carry next to nothing.

A probe's band l contributes Σ_m (A_l L_lm)² / 4π to the mean square of its irradiance over all normals (Parseval).
Bands are given up from the top, the least first over all probes, while the sum of what is given up stays within what
the target leaves. In the file they are zeros, which its compression makes vanish.
"""

from __future__ import annotations

import numpy as np

from .conventions import COSINE_LOBE, bands_of


def band_energy(coefficients: np.ndarray) -> np.ndarray:
    """(P, bands) mean square of irradiance over all normals and colours that each band contributes."""
    bands = bands_of(coefficients.shape[1])
    squared = np.square(np.asarray(coefficients, float)).mean(axis=2) / (4 * np.pi)
    return np.stack([COSINE_LOBE[l] ** 2 * squared[:, l * l : (l + 1) ** 2].sum(axis=1) for l in range(bands)], axis=1)


def bands_needed(coefficients: np.ndarray, counted: np.ndarray, budget: float) -> np.ndarray:
    """(P,) bands, 1 at least, that each probe keeps, so that the mean over the ``counted`` (P,) bool probes of what is
    given up stays within ``budget``, a mean squared irradiance. Other probes give up what the least important of those
    that keep theirs would not."""
    energy = band_energy(coefficients)
    count, bands = energy.shape
    lost = np.cumsum(energy[:, ::-1], axis=1)[:, ::-1]  # by giving up band l and all above
    needed = np.full(count, bands)
    probe, band = (index.ravel() for index in np.indices((count, bands)))
    order = np.lexsort((-band, lost[probe, band]))  # of one probe, upper bands cost less and come first
    order = order[(band[order] > 0) & counted[probe[order]]]
    # Giving up band l of a probe costs what it adds to the bands above, which have been given up before.
    price = np.where(counted, 1.0, 0.0)[probe[order]] * energy[probe[order], band[order]]
    paid = np.cumsum(price) / max(int(counted.sum()), 1)
    given = order[: int(np.searchsorted(paid, budget, side="right"))]
    np.minimum.at(needed, probe[given], band[given])
    if len(given):
        limit = lost[probe[given], band[given]].max()
        others = np.flatnonzero(~counted)
        needed[others] = 1 + (lost[others, 1:] > limit).sum(axis=1)
    return needed


def without_upper_bands(coefficients: np.ndarray, needed: np.ndarray) -> np.ndarray:
    """``coefficients`` (P, K, …) with zeros from band ``needed`` (P,) on; also right for gradients with K there."""
    bands = bands_of(coefficients.shape[1])
    band = np.repeat(np.arange(bands), 2 * np.arange(bands) + 1)
    kept = band[None] < needed[:, None]
    return np.where(kept.reshape(*kept.shape, *[1] * (coefficients.ndim - 2)), coefficients, 0).astype(
        coefficients.dtype
    )
