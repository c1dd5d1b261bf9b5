# SPDX-License-Identifier: GPL-3.0-or-later
"""Coloured holes: closed forms, and every stage that knows them against its twin."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import DITHERED, Image, Light, Material, World
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from small_scenes import all_lights, bake, box, cluttered_room, frame, snapshot_of
from stages import Stages

RED, GREEN = np.array([0.9, 0.3, 0.1]), np.array([0.2, 0.8, 0.4])
GRID = Grid.from_bounds([-0.6, -0.5, -0.5], [0.7, 0.5, 0.4], (3, 2, 2))


def pane(name, tint, **more):
    return Material(name, (0.0,) * 3, alpha=0.0, alpha_threshold=DITHERED, tint=tuple(tint), **more)


def around(half):
    """A cube about the origin, which every ray from inside passes once."""
    return box((-half,) * 3, (half,) * 3)


def mean_radiance(field):
    return field.coefficients[:, 0] / (2 * np.sqrt(np.pi))


@pytest.mark.parametrize("method", ["trace", "raster"])
def test_two_panes_before_the_world(method):
    """From inside two cubes of glass the world has the product of their colours, in all directions."""
    corners = np.concatenate([around(1.0), around(2.0)])
    snapshot = snapshot_of(
        corners, [0] * 12 + [1] * 12, [pane("red", RED), pane("green", GREEN)], world=World((1.0,) * 3)
    )
    field = bake(
        snapshot, Grid.from_bounds([-0.2] * 3, [0.2] * 3, (2, 1, 1)), BakeSettings(keep_all=True, capture=method)
    )
    np.testing.assert_allclose(mean_radiance(field.field), [RED * GREEN] * 2, rtol=2e-3)


def test_half_a_pane():
    """A pane of which half is a red hole and half black sends half of the world's light, red."""
    half = replace(pane("half", RED), alpha=0.5)
    field = bake(
        snapshot_of(around(1.0), [0] * 12, [half], world=World((1.0,) * 3)),
        Grid.from_bounds([-0.1] * 3, [0.1] * 3, (1, 1, 1)),
        BakeSettings(keep_all=True, face=64),
    )
    np.testing.assert_allclose(mean_radiance(field.field)[0], RED / 2, rtol=0.03)


def lit_floor(tint=None, kind="POINT"):
    """A white floor under a lamp in a cube of glass, or a small one that glows."""
    floor = np.array([[-5.0, -5, 0], [5, -5, 0], [5, 5, 0], [-5, 5, 0]])[[[0, 1, 2], [0, 2, 3]]]
    glows = kind == "GLOW"
    parts = [floor, around(0.5) + [0, 0, 2.0], around(0.05) + [0, 0, 2.0]]
    materials = [
        Material("white", (1.0,) * 3),
        pane("glass", (1.0,) * 3 if tint is None else tint),
        Material("bulb", (0.0,) * 3, emission=(100.0 * glows,) * 3, unseen_by=0 if glows else 1),
    ]
    lamps = [] if glows else [Light("lamp", kind, (5.0,) * 3, frame((0, 0, 2)), angle=0.2)]
    number = np.repeat([0, 1, 2], [2, 12, 12])
    return snapshot_of(np.concatenate(parts), number, materials, number, lights=lamps)


@pytest.mark.parametrize("kind", ["POINT", "GLOW"])
def test_light_through_coloured_glass(kind):
    """All that a probe beside the glass sees is light that has passed it: it has the colour of the glass."""
    grid = Grid.from_bounds([1.2, 0, 0.4], [1.4, 0.1, 0.5], (2, 1, 1))
    settings = BakeSettings(keep_all=True, bounces=1)
    colour, white = (mean_radiance(bake(lit_floor(tint, kind), grid, settings).field) for tint in (RED, None))
    np.testing.assert_allclose(colour, white * RED, rtol=1e-3)
    assert white.min() > 0.01


def test_paths_agree():
    """What --error measures by is coloured as well."""
    for kind in ("POINT", "GLOW"):
        snapshot, grid = lit_floor(RED, kind), Grid.from_bounds([1.2, 0, 0.4], [1.4, 0.1, 0.5], (1, 1, 1))
        flux = []
        for one in (snapshot, lit_floor(None, kind)):
            textures = SceneTextures(one, grid.center, np.zeros(len(snapshot.triangles)))
            flux.append(ProbePaths(textures, one, grid, grid.positions()).trace(0, 256, 1, 1)[1].sum(axis=(0, 1, 2)))
        np.testing.assert_allclose(flux[0], flux[1] * RED, rtol=1e-3)


@pytest.fixture(scope="module")
def stages(gpu_context):
    """A cluttered room in which two materials are coloured glass, one of them with a picture."""
    lights = {name: all_lights()[name] for name in ("point", "sun wide", "rectangle")}
    snapshot = cluttered_room(lights)
    pixels = np.random.default_rng(3).uniform(0.2, 1.0, (8, 8, 4)).astype(np.float32)
    snapshot.images.append(Image("panes", pixels))
    picture = len(snapshot.images) - 1
    for number, image in ((4, picture), (5, -1)):
        row = snapshot.materials[number]
        snapshot.materials[number] = replace(
            row, alpha=0.3, alpha_image=-1, alpha_threshold=DITHERED, tint=tuple(RED), tint_image=image
        )
    return Stages(snapshot, GRID, BakeSettings(face=8, keep_all=True, seed=5))


def close(found, expected, tolerance=1e-4):
    return (np.abs(found - expected) <= tolerance * np.abs(expected).max()).reshape(len(expected), -1).all(axis=1)


def test_texels_and_direct_light_agree(stages):
    surfaces, expected = stages.surfaces(), stages.reference.capture()
    same = surfaces.triangle == expected.triangle
    assert same.mean() > 0.99
    for name in ("albedo", "emission"):
        assert close(getattr(surfaces, name)[same], getattr(expected, name)[same], 5e-3).mean() > 0.98
    patches = np.arange(0, stages.light.count, 5)
    direct = stages.reference.light.direct_light(stages.points, patches, 3)
    assert close(stages.direct_of(patches, 3), direct, 2e-3).mean() > 0.98


@pytest.mark.parametrize("segments", [1, 3])
def test_rays_agree(stages, segments):
    first, count, rays_each = 40, 200, 8
    hits, brought, reflected = stages.rays(first, count, rays_each, segments)
    rays = stages.reference.light.trace(stages.points, np.arange(first, first + count), rays_each, segments)
    same = np.abs(hits - rays.hits)[..., :3].max(axis=-1) < 1e-4
    assert same.mean() > 0.97
    assert (np.abs(reflected - rays.reflected).max(axis=-1) < 5e-3)[same].mean() > 0.97
    assert close(brought, rays.brought, 2e-3)[same.all(axis=1)].mean() > 0.95
