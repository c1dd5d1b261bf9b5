# SPDX-License-Identifier: GPL-3.0-or-later
"""In which order probes are relit when not all of them fit into a frame.

Shuffled, so that what is still old is spread over the volume and the eye sees no front; those that a changed lamp
lights most come early, by chance and in proportion: each probe draws −log(u)/w for its weight w and the smallest comes
first (weighted sampling without replacement; Efraimidis and Spirakis, Information Processing Letters 97, 2006). Probes
that the last round left out come before all others, so that none waits for ever while lights keep moving.
"""

from __future__ import annotations

import numpy as np

from .snapshot import Light

_LEAST_SHARE = 0.1  # of the mean weight that every probe has: bounced light reaches everywhere


def update_order(weights: np.ndarray, waiting: np.ndarray, seed: int) -> np.ndarray:
    """(S,) all probes, those first that are ``waiting`` (S,) bool, each part shuffled by ``weights`` (S,) > 0."""
    draw = np.random.default_rng(seed).exponential(size=len(weights)) / weights
    return np.lexsort([draw, ~waiting])


def change_weights(positions: np.ndarray, old: list[Light], new: list[Light], nearest_m: float) -> np.ndarray:
    """(S,) how much light of lamps that differ between ``old`` and ``new`` may have changed at ``positions`` (S, 3),
    world metres, if nothing stands between; all alike where no lamp differs. Distances count as ``nearest_m`` at
    least."""
    total = np.zeros(len(positions))
    none = Light("", "POINT", (0.0, 0.0, 0.0), np.eye(4))
    for index in range(max(len(old), len(new))):
        before = old[index] if index < len(old) else none
        after = new[index] if index < len(new) else none
        same_place = before.kind == after.kind and np.array_equal(before.matrix, after.matrix)
        if same_place:
            change = np.abs(np.subtract(before.color, after.color)).sum()
            total += change * _falloff(after, positions, nearest_m)
        else:
            for light in (before, after):
                total += np.sum(light.color) * _falloff(light, positions, nearest_m)
    mean = total.mean() if len(total) else 0.0
    return total / mean + _LEAST_SHARE if mean > 0 else np.ones(len(positions))


def _falloff(light: Light, positions: np.ndarray, nearest_m: float) -> np.ndarray:
    """(S,) one over squared distance; suns reach everywhere alike."""
    if light.kind == "SUN":
        return np.ones(len(positions))
    squared = ((positions - np.asarray(light.matrix)[:3, 3]) ** 2).sum(axis=1)
    return 1.0 / np.maximum(squared, nearest_m**2)
