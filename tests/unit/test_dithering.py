# SPDX-License-Identifier: GPL-3.0-or-later
"""Dithered transparency: thresholds are spread evenly, independent between triangles and the same for a whole cell."""

import numpy as np
from gridlight.core.dithering import CELLS, dither_threshold


def test_thresholds_are_even_and_independent():
    cells = (np.stack(np.meshgrid(np.arange(64), np.arange(64)), -1).reshape(-1, 2) + 0.5) / CELLS
    first, second = (dither_threshold(np.full(len(cells), index), cells) for index in (7, 8))
    for values in (first, second):
        histogram = np.histogram(values, 8, (0, 1))[0] / len(values)
        assert np.abs(histogram - 1 / 8).max() < 0.02
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.05
    rows = first.reshape(64, 64)
    assert abs(np.corrcoef(rows[:, 1:].ravel(), rows[:, :-1].ravel())[0, 1]) < 0.05


def test_a_cell_has_one_threshold():
    inside = np.array([[0.5001, 0.25], [0.5037, 0.2535]])
    assert len(set(dither_threshold(np.array([3, 3]), inside))) == 1
