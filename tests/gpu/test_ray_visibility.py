# SPDX-License-Identifier: GPL-3.0-or-later
"""Surfaces that some kinds of rays do not see."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import DIFFUSE_RAYS, FROM_BEHIND, FROM_FRONT, SHADOW_RAYS, Light, Material, World
from small_scenes import all_lights, bake, cluttered_room, frame, snapshot_of
from stages import Stages

GRID = Grid.from_bounds([-0.6, -0.5, -0.5], [0.7, 0.5, 0.4], (3, 2, 2))


def plane(z, half, up=True):
    corners = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return corners[[[0, 1, 2], [0, 2, 3]] if up else [[0, 2, 1], [0, 3, 2]]]


def scene(unseen_by):
    """A white floor under a lamp, a black screen between, and a sky of 1."""
    corners = np.concatenate([plane(0.0, 5.0), plane(2.0, 2.0)])
    materials = [Material("white", (1.0,) * 3), Material("black", (0.0,) * 3, unseen_by=unseen_by)]
    lamp = Light("lamp", "POINT", (10.0,) * 3, frame((0, 0, 3)))
    return snapshot_of(corners, [0, 0, 1, 1], materials, lights=[lamp], world=World((1.0,) * 3))


def below(snapshot, method="trace"):
    """(2,) radiance that arrives under the screen, from straight below and from straight above."""
    grid = Grid.from_bounds([-0.01, -0.01, 0.4], [0.01, 0.01, 0.6], (1, 1, 1))
    field = bake(snapshot, grid, BakeSettings(keep_all=True, face=32, capture=method, bounces=0)).field
    basis = np.array([0.282095, 0.488603, 0.315392 * 2])  # of 1, z and 3z² − 1 along ±z
    along_z = field.coefficients[0, [0, 2, 6], 0]
    return np.array([along_z @ (basis * [1, -1, 1]), along_z @ basis])


@pytest.mark.parametrize("method", ["trace", "raster"])
def test_what_no_diffuse_ray_sees_is_not_there_for_probes(method):
    """The sky is seen through the screen, whose shadow stays."""
    seen, unseen = below(scene(0), method), below(scene(DIFFUSE_RAYS), method)
    assert unseen[1] > seen[1] + 0.5
    shadowless = replace(scene(DIFFUSE_RAYS).lights[0], casts_shadow=False)
    lit = below(replace(scene(DIFFUSE_RAYS), lights=[shadowless]), method)
    assert lit[0] > unseen[0] + 0.1, "the lamp's shadow lies on the floor"


def test_what_no_shadow_ray_sees_casts_none():
    """The floor is lit as if the lamp cast no shadow, and the screen still hides the sky."""
    plain = scene(0)
    shadowless = replace(plain, lights=[replace(plain.lights[0], casts_shadow=False)])
    np.testing.assert_allclose(below(scene(SHADOW_RAYS)), below(shadowless), rtol=1e-4)
    assert below(plain)[0] < below(shadowless)[0] - 0.1


def test_stages_agree():
    """Texels, direct light and rays of a cluttered room, some of whose clutter only one kind of ray sees."""
    snapshot = cluttered_room({name: all_lights()[name] for name in ("point", "sun wide", "rectangle")})
    for number, unseen_by in ((4, SHADOW_RAYS), (0, DIFFUSE_RAYS), (5, FROM_BEHIND), (3, FROM_FRONT)):
        snapshot.materials[number] = replace(snapshot.materials[number], unseen_by=unseen_by)
    stages = Stages(snapshot, GRID, BakeSettings(face=8, keep_all=True, seed=5))
    expected = stages.reference.capture()
    assert (stages.surfaces().triangle == expected.triangle).mean() > 0.995
    assert 0 not in set(snapshot.material_index[expected.triangle[expected.triangle >= 0]])
    patches = np.arange(0, stages.light.count, 5)
    found, direct = stages.direct_of(patches, 3), stages.reference.light.direct_light(stages.points, patches, 3)
    assert (np.abs(found - direct).max(axis=1) <= 1e-5 * direct.max()).mean() > 0.985
    hits = stages.rays(40, 200, 4)[0]
    rays = stages.reference.light.trace(stages.points, np.arange(40, 240), 4)
    assert (np.abs(hits - rays.hits)[..., :3].max(axis=-1) < 1e-4).mean() > 0.98


@pytest.mark.parametrize("method", ["trace", "raster"])
def test_what_is_not_there_from_behind(method):
    """From below, a screen that faces down hides the sky and the lamp; one that faces up hides neither."""
    facing_up, facing_down = scene(FROM_BEHIND), scene(FROM_BEHIND)
    turned = np.concatenate([plane(0.0, 5.0), plane(2.0, 2.0, up=False)])
    facing_down = snapshot_of(
        turned, [0, 0, 1, 1], facing_up.materials, lights=facing_up.lights, world=World((1.0,) * 3)
    )
    up, down, plain = below(facing_up, method), below(facing_down, method), below(scene(0), method)
    open_sky = below(scene(SHADOW_RAYS + DIFFUSE_RAYS), method)
    np.testing.assert_allclose(down, plain, rtol=1e-4)
    np.testing.assert_allclose(up, open_sky, rtol=1e-4)
    assert (open_sky > plain + 0.1).all()


@pytest.mark.parametrize("method", ["trace", "raster"])
def test_two_sides_of_one_surface(method):
    """The same triangles twice, each from one side, are what a screen of the colour of that side is."""
    plain = scene(0)
    for chosen, turn in ((2, FROM_BEHIND), (1, FROM_FRONT)):  # from below the screen is seen from behind
        grey = Material("grey", (0.0,) * 3, emission=(0.4,) * 3)
        corners = np.concatenate([plain.triangle_positions, plain.triangle_positions[2:]])
        sides = [
            replace(plain.materials[1], unseen_by=FROM_BEHIND if chosen == 2 else FROM_FRONT),
            replace(grey, unseen_by=FROM_FRONT if chosen == 2 else FROM_BEHIND),
        ]
        two = snapshot_of(
            corners, [0, 0, 1, 1, 2, 2], [plain.materials[0], *sides], lights=plain.lights, world=plain.world
        )
        one = replace(plain, materials=[plain.materials[0], grey if chosen == 2 else plain.materials[1]])
        np.testing.assert_allclose(below(two, method), below(one, method), rtol=1e-3, err_msg=str(turn))
