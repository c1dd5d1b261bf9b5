# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels between those of sRGB images."""

import numpy as np
import pytest
from gridlight.scene.image_interpolation import finer_grid

pytestmark = pytest.mark.any_version


def square(values):
    return values**2


def test_smooth_images_stay_as_they_are():
    ramp = np.linspace(0.2, 0.8, 64)[None, :, None] * np.ones((64, 1, 3))
    assert finer_grid(ramp, square, "Linear", "EXTEND") is None
    assert finer_grid(np.random.default_rng(0).random((8, 8, 3)), square, "Closest", "REPEAT") is None


def test_mean_between_two_values():
    """Columns of 0 and 1 with their linear interpolation in between, decoded by a square: the mean is ∫ t² dt = 1/3."""
    columns = np.tile([0.0, 1.0], 16)[None, :, None] * np.ones((32, 1, 1))
    finer = finer_grid(columns, square, "Linear", "REPEAT")
    assert finer.shape == (256, 256, 1)
    assert square(finer).mean() == pytest.approx(1 / 3, abs=0.005)
    assert square(finer_grid(columns, square, "Cubic", "REPEAT")).mean() < 0.3, "a spline is flatter"


def test_large_images_are_judged_by_pieces():
    """Noise is found in an image of which pieces are looked at, and a step at the rims of pieces is none."""
    noise = np.random.default_rng(3).random((300, 500, 3)).astype(np.float32)
    assert finer_grid(noise, square, "Linear", "REPEAT").shape == (600, 1000, 3)
    slope = np.linspace(0, 1, 300, dtype=np.float32)[:, None, None] * np.ones((1, 500, 3), np.float32)
    assert finer_grid(slope, square, "Linear", "REPEAT") is None


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_rims(extension):
    """Beyond the rim of a bright pixel lies what the extension says."""
    image = np.zeros((4, 4, 1))
    image[:, 0] = 1.0
    finer = finer_grid(image, square, "Linear", extension)
    assert finer[0, -1, 0] == pytest.approx(0.4375 if extension == "REPEAT" else 0.0)
    assert finer[0, 0, 0] == pytest.approx(0.5625 if extension == "REPEAT" else 1.0)
