# SPDX-License-Identifier: GPL-3.0-or-later
"""Looking up images: where texels lie, what happens past the edge, and which mip level is taken."""

import numpy as np
import pytest
from gridlight.core import images
from gridlight.core.snapshot import Image


def ramp(width=4, height=2, extension="REPEAT"):
    """Red counts columns, green rows, from the bottom."""
    pixels = np.zeros((height, width, 4), np.float32)
    pixels[..., 0], pixels[..., 1], pixels[..., 3] = np.arange(width), np.arange(height)[:, None], 1
    return Image("ramp", pixels, extension)


def sample(image, uv, footprint=0.0):
    uv = np.atleast_2d(np.asarray(uv, float))
    return images.sample_image(image, uv, np.full(len(uv), footprint))


def test_texel_centres_and_rows_from_the_bottom():
    found = sample(ramp(), [[(c + 0.5) / 4, (r + 0.5) / 2] for r in range(2) for c in range(4)])
    np.testing.assert_array_equal(found[:, :2], [[c, r] for r in range(2) for c in range(4)])


def test_bilinear_between_centres():
    np.testing.assert_allclose(sample(ramp(), [0.5, 0.5])[0, :2], [1.5, 0.5])


@pytest.mark.parametrize(
    "extension,expected", [("REPEAT", [3, 0]), ("EXTEND", [0, 3]), ("MIRROR", [0, 3]), ("CLIP", [0, 0])]
)
def test_past_the_edge(extension, expected):
    found = sample(ramp(extension=extension), [[-0.125, 0.25], [1.125, 0.25]])
    np.testing.assert_allclose(found[:, 0], expected)
    assert (found[:, 3] == (0 if extension == "CLIP" else 1)).all()


def test_mirror_turns_every_second_repeat():
    image = ramp(extension="MIRROR")
    u = np.array([0.125, 0.375, 0.625, 0.875])
    found = [sample(image, np.stack([u + shift, 0 * u + 0.25], 1))[:, 0] for shift in (0, 1, 2, -1)]
    np.testing.assert_allclose(found, [[0, 1, 2, 3], [3, 2, 1, 0], [0, 1, 2, 3], [3, 2, 1, 0]], atol=1e-9)


def test_mips_keep_the_mean():
    pixels = np.random.default_rng(0).random((16, 8, 4)).astype(np.float32)
    mean = pixels.mean(axis=(0, 1))
    for _ in range(4):
        pixels = images.smaller(pixels)
        np.testing.assert_allclose(pixels.mean(axis=(0, 1)), mean, rtol=1e-6)
    assert pixels.shape == (1, 1, 4)


def test_levels():
    image = ramp(64, 32)
    footprints = np.array([0, 1 / 64, 1.4 / 64, 1.5 / 64, 2 / 64, 4 / 64, 0.5, 1, 1000])
    np.testing.assert_array_equal(images.mip_level(image, footprints), [0, 0, 0, 1, 1, 2, 5, 6, 6])


def test_a_wide_footprint_sees_the_mean():
    pixels = np.random.default_rng(1).random((32, 32, 4)).astype(np.float32)
    found = sample(Image("noise", pixels), [[0.1, 0.7], [0.9, 0.2]], footprint=1.0)
    np.testing.assert_allclose(found, np.tile(pixels.mean(axis=(0, 1)), (2, 1)), rtol=1e-3)


def test_texels_are_half_floats():
    image = Image("bright", np.full((1, 1, 4), 1e6, np.float32))
    assert (sample(image, [0.5, 0.5]) == images.HALF_MAX).all()
