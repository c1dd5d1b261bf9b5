# SPDX-License-Identifier: GPL-3.0-or-later
"""The limit of a linear iteration from its last states, and the sums that tell how far it is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

STATES = 9  # that are kept for it
_LEAST_GAIN = 0.9  # of the last change: an extrapolation that leaves more of it is not worth having


class Sums(NamedTuple):
    """Over the patches in probes' sight, squares to one scale. Slow patches lie in hollows that light takes more than
    PATIENCE bounces to enter or leave (core/patches.py), and have not settled."""

    energy: float  # |irradiance|²
    change: float  # |irradiance − the one before|²
    overlap: float  # change · the change before
    slow: float = 0.0  # share of the patches
    open_energy: float = 0.0  # |irradiance|² of the others
    open_tail: float = 0.0  # |what is still to come|² of the others, each by its own last two changes


def reduced_rank(states: np.ndarray) -> np.ndarray | None:
    """(N, C) limit of the iteration whose last states are ``states`` (K, N, C), newest first; None if they do not tell.

    Reduced rank extrapolation (Eddy 1979; Mesina 1977; Sidi, "Vector Extrapolation Methods", 2017, ch. 2): of all
    combinations Σ γₖ xₖ with Σ γₖ = 1 the one whose next change would be smallest, which for a linear iteration is
    Σ γₖ (xₖ₊₁ − xₖ); equivalent to GMRES. Many slow modes, such as cupboards that fill with light at a pace of
    their own each, are found together.
    """
    changes = states[:-1] - states[1:]
    count = len(changes)
    products = np.empty((count, count))
    for i in range(count):  # summed in numpy's fixed order, in float64: the same bytes in every run
        for j in range(i, count):
            products[i, j] = products[j, i] = np.sum(changes[i] * changes[j], dtype=np.float64)
    trace = float(np.trace(products))
    if not 0 < trace < np.inf:
        return None
    shares = np.linalg.solve(products + 1e-14 * trace * np.eye(count), np.ones(count))
    shares /= shares.sum()
    left = float(shares @ products @ shares)
    if not left < _LEAST_GAIN**2 * products[0, 0]:
        return None
    return np.einsum("k,knc->nc", shares, states[:-1])
