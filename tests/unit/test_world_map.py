# SPDX-License-Identifier: GPL-3.0-or-later
"""The background as texels see it: energy and place of what a map holds, at any face size."""

import numpy as np
import pytest
from gridlight.core.cubemap import direction_to_texel, texel_directions, texel_solid_angles
from gridlight.core.panorama import panorama_directions, panorama_solid_angles
from gridlight.core.snapshot import World
from gridlight.core.world_map import world_texels

FACES = (4, 7, 16, 32)


def energy(texels):
    return np.einsum("frc,frcx->x", np.tile(texel_solid_angles(texels.shape[1]), (6, 1, 1)), texels)


@pytest.mark.parametrize("face", FACES)
def test_one_colour_fills_every_texel(face):
    texels = world_texels(World((0.25, 0.5, 2.0)), face)
    assert texels.shape == (6, face, face, 3)
    assert (texels == [0.25, 0.5, 2.0]).all()


@pytest.mark.parametrize("face", FACES)
@pytest.mark.parametrize("size", [(2, 1), (3, 24), (64, 32), (256, 128)])
def test_a_uniform_map_is_uniform(face, size):
    texels = world_texels(World(map=np.full((size[1], size[0], 3), 0.5, np.float32)), face)
    np.testing.assert_allclose(texels, 0.5, rtol=1e-12)


@pytest.mark.parametrize("face", FACES)
@pytest.mark.parametrize("height", [32, 128, 512])
def test_a_sun_of_one_pixel_keeps_its_energy(face, height):
    row, column = int(0.7 * height), int(0.3 * height)
    sky = np.zeros((height, 2 * height, 3), np.float32)
    sky[row, column] = (1e4, 1e5, 10)
    expected = sky[row, column] * panorama_solid_angles(2 * height, height)[row, column]
    np.testing.assert_allclose(energy(world_texels(World(map=sky), face)), expected, rtol=1e-3)


@pytest.mark.parametrize("face", (8, 16))
def test_a_sun_lies_in_the_texel_of_its_direction(face):
    height = 256
    sky = np.zeros((height, 2 * height, 3), np.float32)
    row, column = 170, 77
    sky[row, column] = 100
    lit = np.argwhere(world_texels(World(map=sky), face)[..., 0] > 0)
    at = direction_to_texel(panorama_directions(2 * height, height)[row, column], face)
    assert tuple(at) in {tuple(texel) for texel in lit}
    assert len(lit) <= 4


@pytest.mark.parametrize("face", (8, 16))
def test_a_sun_shines_from_where_it_stands(face):
    """Its light's mean direction is its own within a sixth of a texel; a single texel would be up to 0.7 off."""
    solid_angles, directions = np.tile(texel_solid_angles(face), (6, 1, 1)), texel_directions(face)
    for row, column in np.random.default_rng(5).integers((20, 0), (236, 512), (6, 2)):
        sky = np.zeros((256, 512, 3), np.float32)
        sky[row, column] = 100
        light = world_texels(World(map=sky), face)[..., 0] * solid_angles
        mean = np.einsum("frc,frci->i", light, directions)
        cosine = mean @ panorama_directions(512, 256)[row, column] / np.linalg.norm(mean)
        assert np.arccos(min(cosine, 1.0)) < np.pi / 2 / face / 6


def test_a_smooth_sky_is_what_its_directions_say():
    """A map of 1 + z, resolved well, must come back as 1 + z at the texels: this fixes up, down and the sides."""
    for axis in range(3):
        sky = (1 + panorama_directions(512, 256)[..., axis : axis + 1]).repeat(3, axis=2)
        texels = world_texels(World(map=sky), 16)
        np.testing.assert_allclose(texels[..., 0], 1 + texel_directions(16)[..., axis], atol=0.01)


def test_nothing_turns_negative():
    sky = np.zeros((32, 64, 3), np.float32)
    sky[20, 10] = 1e6
    assert (world_texels(World(map=sky), 8) >= 0).all()
