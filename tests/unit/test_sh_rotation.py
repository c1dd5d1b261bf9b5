# SPDX-License-Identifier: GPL-3.0-or-later
"""Turning light: against evaluating it in turned directions, and against the closed form for Y-up."""

import numpy as np
import pytest
from gridlight.core import spherical_harmonics as sh
from gridlight.core.sh_rotation import rotate, rotation

RNG = np.random.default_rng(5)
TURN = np.linalg.qr(RNG.normal(size=(3, 3)))[0]


@pytest.mark.parametrize("bands", [1, 2, 3, 4])
@pytest.mark.parametrize("matrix", [TURN, -TURN, np.diag([1.0, 1, -1])], ids=["one way", "mirrored", "flip"])
def test_turned_light_comes_from_turned_directions(bands, matrix):
    light = RNG.normal(size=(7, bands * bands, 3))
    directions = RNG.normal(size=(50, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    turned = rotate(light, matrix)
    expected = sh.radiance(light[:, None], directions)
    np.testing.assert_allclose(sh.radiance(turned[:, None], directions @ matrix.T), expected, atol=1e-12)


def test_y_up_is_the_known_permutation_of_three_bands():
    """(x, z, −y), with s = √3/2: c0, c2, −c1, c3, c7, −c5, −½c6 − s·c8, −c4, −s·c6 + ½c8."""
    light = RNG.normal(size=(9, 3))
    y_up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
    s = np.sqrt(3) / 2
    c = light
    expected = [c[0], c[2], -c[1], c[3], c[7], -c[5], -0.5 * c[6] - s * c[8], -c[4], -s * c[6] + 0.5 * c[8]]
    np.testing.assert_allclose(rotate(light, y_up), expected, atol=1e-14)


def test_turns_follow_one_another():
    np.testing.assert_allclose(rotation(TURN, 4) @ rotation(-TURN.T, 4), rotation(-np.eye(3), 4), atol=1e-13)
