# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns taken out of environment maps: nothing is lost, nothing counts twice."""

import numpy as np
import pytest
from gridlight.core.panorama import panorama_directions, panorama_irradiance, panorama_solid_angles
from gridlight.core.snapshot import World
from gridlight.core.world_suns import extract_suns

NORMALS = np.concatenate([np.eye(3), -np.eye(3)])


def sky(width=256, height=128, level=0.5):
    radiance = np.full((height, width, 3), level, np.float32)
    return radiance * (1 + 0.5 * panorama_directions(width, height)[..., 2:]).astype(np.float32)


def with_disc(radiance, towards, degrees, strength):
    directions = panorama_directions(radiance.shape[1], radiance.shape[0])
    towards = np.asarray(towards, float) / np.linalg.norm(towards)
    inside = directions @ towards >= np.cos(np.radians(degrees / 2))
    radiance = radiance.copy()
    radiance[inside] = strength
    return radiance, towards


@pytest.mark.parametrize("strength", [(300.0, 280.0, 200.0), (1e6, 9e5, 5e5)])
@pytest.mark.parametrize("towards", [(1, 0.4, 0.7), (-0.2, 0.1, 1.0), (-1, 0.001, 0.3)])
def test_one_sun(towards, strength):
    radiance, towards = with_disc(sky(), towards, 3.0, strength)
    rest, suns = extract_suns(World(map=radiance))
    assert len(suns) == 1
    sun = suns[0]
    np.testing.assert_allclose(sun.matrix[:3, 2], towards, atol=0.01)
    np.testing.assert_allclose(np.linalg.det(sun.matrix[:3, :3]), 1, atol=1e-9)
    assert 1.5 < np.degrees(sun.angle) < 4.5
    omega = panorama_solid_angles(256, 128)[..., None]
    whole, kept = (np.sum(np.asarray(m, float) * omega, axis=(0, 1)) for m in (radiance, rest.map))
    np.testing.assert_allclose(kept + np.array(sun.color), whole, rtol=1e-5)
    assert rest.map.max() < 0.01 * max(strength)
    cosine = np.maximum(NORMALS @ sun.matrix[:3, 2], 0)
    found = panorama_irradiance(rest.map, NORMALS) + cosine[:, None] * np.array(sun.color)
    expected = panorama_irradiance(radiance, NORMALS)
    # a disc on the horizon lights both sides of it a little
    np.testing.assert_allclose(found, expected, atol=8e-3 * expected.max())


def test_two_suns_and_their_glow():
    radiance, first = with_disc(sky(), (1, 0, 1), 6.0, (20.0, 20.0, 20.0))
    radiance, first = with_disc(radiance, first, 2.0, (900.0, 900.0, 900.0))
    radiance, second = with_disc(radiance, (-1, 1, 0.2), 2.0, (400.0, 100.0, 100.0))
    _rest, suns = extract_suns(World(map=radiance))
    assert len(suns) == 2
    np.testing.assert_allclose([s.matrix[:3, 2] for s in suns], [first, second], atol=0.02)


@pytest.mark.parametrize("deviation", [3.0, 6.0])
def test_a_veiled_sun(deviation):
    """A glow of Gauss' shape becomes a disc of twice its deviation as radius, but for its dim rim, which stays."""
    glow = np.array([1.0, 0.3, 0.8]) / np.linalg.norm([1.0, 0.3, 0.8])
    angle = np.arccos(np.clip(panorama_directions(256, 128) @ glow, -1, 1))
    radiance = sky(level=0.2) + (120.0 * np.exp(-((angle / np.radians(deviation)) ** 2) / 2))[..., None]
    radiance = radiance.astype(np.float32)
    rest, suns = extract_suns(World(map=radiance))
    assert len(suns) == 1 and np.degrees(suns[0].angle) == pytest.approx(4 * deviation, rel=0.15)
    cosine = np.maximum(NORMALS @ suns[0].matrix[:3, 2], 0)
    found = panorama_irradiance(rest.map, NORMALS) + cosine[:, None] * np.array(suns[0].color)
    np.testing.assert_allclose(found, panorama_irradiance(radiance, NORMALS), rtol=0.01, atol=0.01)


def test_even_skies_and_large_bright_parts_stay():
    for world in (
        World(color=(1, 2, 3)),
        World(map=sky()),
        World(map=np.zeros((8, 16, 3), np.float32)),
        World(map=with_disc(sky(level=0.001), (0, 0, 1), 40.0, (1.0, 1.0, 1.0))[0]),
    ):
        rest, suns = extract_suns(world)
        assert not suns and rest is world
