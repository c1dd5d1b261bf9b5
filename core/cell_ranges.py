# SPDX-License-Identifier: GPL-3.0-or-later
"""All cells or nodes of many boxes of a lattice at once, without a loop over boxes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np


def cells_of_boxes(first: np.ndarray, last: np.ndarray, at_once: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Every lattice place of the boxes from ``first`` to ``last`` (N, 3) int64, both included, none of them empty.

    Yields the box (K,) and the place (K, 3) of each, box by box and x fastest, K ≤ ``at_once`` a time: that bounds the
    memory of what is done with them.
    """
    spans = last - first + 1
    counts = spans.prod(axis=1)
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    for start in range(0, total, at_once):
        number = np.arange(start, min(start + at_once, total))
        box = np.searchsorted(ends, number, side="right")
        rank = number - (ends[box] - counts[box])
        span = spans[box]
        step = np.stack([rank % span[:, 0], rank // span[:, 0] % span[:, 1], rank // (span[:, 0] * span[:, 1])], axis=1)
        yield box, first[box] + step
