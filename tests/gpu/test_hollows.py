# SPDX-License-Identifier: GPL-3.0-or-later
"""Closed cupboards and slits, where light stays for ever or hardly gets in."""

import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.core.patches import NO_PATCH, NOTHING, caught
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material
from gridlight.gpu_shaders import textures
from gridlight.gpu_shaders.dispatch import dispatch_linear
from gridlight.gpu_shaders.programs import program
from small_scenes import bake, box, frame, irradiance_at_nodes, snapshot_of

GRID = Grid.from_bounds([-1.2] * 3, [1.2] * 3, (5, 5, 5))
LAMP = Light("lamp", "POINT", (30.0, 30.0, 30.0), frame((1.1, 0.9, 1.2)), radius=0.05)
GREY, WHITE = Material("grey", (0.6, 0.6, 0.6)), Material("white", (1.0, 1.0, 1.0))


def cupboard(gap):
    """A cupboard of white boards of 2 cm around the node in the middle of a room; its lid lies ``gap`` metres above it,
    or reaches into it."""
    inner, outer = 0.26, 0.28
    sides = [
        box((-outer, -outer, -outer), (outer, outer, -inner)),
        *(box((low, -outer, -outer), (low + 0.02, outer, inner)) for low in (-outer, inner)),
        *(box((-outer, low, -outer), (outer, low + 0.02, inner)) for low in (-outer, inner)),
        box((-outer, -outer, inner + gap), (outer, outer, outer + gap)),
    ]
    boards = np.concatenate(sides)
    room = box((-1.5,) * 3, (1.5,) * 3)[:, ::-1]
    materials = np.repeat([0, 1], [len(room), len(boards)])
    return snapshot_of(np.concatenate([room, boards]), materials, [GREY, WHITE], materials, lights=[LAMP])


@pytest.fixture(scope="module")
def ajar():
    return bake(cupboard(0.003), GRID, BakeSettings(face=12))


def in_it(result):
    """Irradiance in the cupboard against the room's."""
    found = irradiance_at_nodes(result.field).mean(axis=(1, 2)).reshape(5, 5, 5)
    return found[2, 2, 2] / found[0].mean()


def test_nobody_waits_for_a_cupboard_and_it_is_named(ajar):
    assert ajar.converged and 33 <= ajar.iterations < 45
    assert any("1 of " in warning and "(2, 2, 2)." in warning for warning in ajar.warnings)


def test_light_creeps_into_a_cupboard(ajar):
    """Through the gap of 3 mm around the lid comes 0.5 % of what its walls would get in the open, a bounce."""
    assert 0.02 < in_it(ajar) < 0.3


def test_a_shut_cupboard_is_dark_and_nothing_in_it_is_waited_for():
    shut = bake(cupboard(-0.005), GRID, BakeSettings(face=12))
    assert shut.converged and shut.iterations < 20 and not any("hollow" in warning for warning in shut.warnings)
    assert in_it(shut) == 0


def test_caught_rays_as_the_reference_finds_them():
    """Few patches and many rays to each other, so that sets of all sizes close."""
    random = np.random.default_rng(5)
    ends = np.repeat(np.arange(3000)[:, None], 8, axis=1) // 3 * 3 + random.integers(0, 3, (3000, 8))
    ends = np.where(random.random(ends.shape) < 0.02, random.integers(0, 3000, ends.shape), ends)
    ends = np.where(random.random(ends.shape) < 0.02, NO_PATCH, ends)
    ends = np.where(random.random(ends.shape) < 0.01, NOTHING, ends)
    texture, shader = textures.numbers(ends.ravel().astype(np.float32), "rays"), program("patch_caught_comp")
    shader.image("ray_ends", texture)
    shader.uniform_int("patch_count", (3000,))
    shader.uniform_int("rays_each", (8,))
    dispatch_linear(shader, 3000)
    expected = ends.copy()
    expected[caught(ends), 0] = NOTHING
    assert 300 < (expected != ends).any(axis=1).sum() < 2700
    np.testing.assert_array_equal(textures.read(texture, ends.size, channels=1).reshape(ends.shape), expected)
