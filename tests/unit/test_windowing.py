# SPDX-License-Identifier: GPL-3.0-or-later
"""Windows against their formulas."""

import numpy as np
from gridlight.core import windowing


def test_windows_are_their_formulas():
    np.testing.assert_allclose(windowing.hann(4, 4), [1, 0.5 + 0.5**1.5, 0.5, 0.5 - 0.5**1.5], atol=1e-15)
    np.testing.assert_allclose(windowing.hann(4, 2), [1, 0.5, 0, 0], atol=1e-15)
    np.testing.assert_allclose(windowing.lanczos(3, 2), [1, 2 / np.pi, 0], atol=1e-15)


def test_a_window_scales_whole_bands():
    scaled = windowing.apply(np.ones((2, 9, 3)), np.array([[1, 0.5, 0.25], [1, 1, 0]]))
    assert np.array_equal(scaled[0, :, 0], [1] + [0.5] * 3 + [0.25] * 5)
    assert np.array_equal(scaled[1, :, 2], [1] * 4 + [0] * 5)
