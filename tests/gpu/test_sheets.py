# SPDX-License-Identifier: GPL-3.0-or-later
"""Translucent sheets: closed forms, and every stage that knows them against its twin."""

import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.core.patches import Patches
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Material
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from gridlight.gpu_shaders.textures import read
from small_scenes import all_lights, bake, box, cluttered_room, furnace, snapshot_of
from stages import Stages

REFLECTED, THROUGH = np.array([0.3, 0.2, 0.1]), np.array([0.5, 0.4, 0.6])
GRID = Grid.from_bounds([-0.6, -0.5, -0.5], [0.7, 0.5, 0.4], (3, 2, 2))
SHEET = Material("sheet", tuple(REFLECTED + THROUGH), transmitted=tuple(THROUGH / (REFLECTED + THROUGH)))


def two_halves():
    """Two cubes of 2 m with a sheet between them at x = 0: the walls of the first glow with radiance 1, those of the
    second are black. No wall reflects."""
    first, second = box((-2, -1, -1), (0, 1, 1))[:, ::-1], box((0, -1, -1), (2, 1, 1))[:, ::-1]
    at_zero = lambda corners: (np.abs(corners[..., 0]) < 1e-9).all(axis=1)  # noqa: E731
    walls = np.concatenate([first[~at_zero(first)], second[~at_zero(second)]])
    sheet = first[at_zero(first)]
    material = np.concatenate([(walls[:, :, 0].mean(axis=1) > 0).astype(int), [2] * len(sheet)])
    black = (0.0, 0.0, 0.0)
    materials = [Material("glowing", black, emission=(1.0, 1.0, 1.0)), Material("black", black), SHEET]
    return snapshot_of(np.concatenate([walls, sheet]), material, materials)


def mean_radiance(field):
    return field.coefficients[:, 0] / (2 * np.sqrt(np.pi))


@pytest.mark.parametrize("gather", [0, 1, 2])
def test_what_goes_through(gather):
    """From the middle of a cube the sheet is a sixth of all directions; it shows T behind and R before."""
    grid = Grid.from_bounds([-1, -0.1, -0.1], [1, 0.1, 0.1], (2, 1, 1))
    field = bake(two_halves(), grid, BakeSettings(keep_all=True, gather=gather)).field
    before, behind = mean_radiance(field)
    np.testing.assert_allclose(behind, THROUGH / 6, rtol=0.02)
    np.testing.assert_allclose(before, (5 + REFLECTED) / 6, rtol=0.02)


@pytest.mark.any_version
def test_paths_agree():
    """What --error measures by goes through sheets as well."""
    snapshot, grid = two_halves(), Grid.from_bounds([-1, -0.1, -0.1], [1, 0.1, 0.1], (2, 1, 1))
    scene = SceneTextures(snapshot, grid.center, np.zeros(len(snapshot.triangles)))
    flux = ProbePaths(scene, snapshot, grid, grid.positions()).trace(0, 512, None, 1)[1]
    expected = np.stack([(5 + REFLECTED) / 6, THROUGH / 6])
    np.testing.assert_allclose(flux.mean(axis=0).sum(axis=1) / 512 / (4 * np.pi), expected, rtol=0.06)


def test_furnace_with_a_sheet():
    """A sheet that sends on as much as walls reflect, and glows as they do, is not seen in a furnace."""
    closed = furnace(0.8, inward=True)
    sheet = np.array([[[0.2, -0.5, -0.5], [0.3, 0.6, -0.4], [0.1, 0.0, 0.7]]])
    materials = [*closed.materials, Material("sheet", (0.8,) * 3, emission=(1.0,) * 3, transmitted=(0.6, 0.2, 1.0))]
    corners = np.concatenate([closed.triangle_positions, sheet])
    snapshot = snapshot_of(corners, [0] * (len(corners) - 1) + [1], materials)
    grid = Grid.from_bounds([-0.5, -0.5, -0.5], [0.5, 0.5, 0.5], (2, 2, 2))
    found = bake(snapshot, grid, BakeSettings(keep_all=True, tolerance=1e-4)).field
    np.testing.assert_allclose(mean_radiance(found), 5.0, rtol=2e-3)


@pytest.fixture(scope="module")
def stages(gpu_context):
    """A cluttered room whose plain walls and nets are sheets, connected."""
    lights = {name: all_lights()[name] for name in ("point", "sun wide", "rectangle")}
    snapshot = cluttered_room(lights)
    for number, share in ((0, (0.2, 0.5, 0.7)), (5, (1.0, 0.4, 0.0))):
        row = snapshot.materials[number]
        snapshot.materials[number] = Material(**{**vars(row), "transmitted": share})
    made = Stages(snapshot, GRID, BakeSettings(face=8, keep_all=True, seed=5, gather=1))
    made.lit_directly = made.direct()
    return made


def close(found, expected, tolerance=1e-5):
    scale = np.abs(expected).max()
    return (np.abs(found - expected) <= tolerance * scale).reshape(len(expected), -1).all(axis=1)


def test_patches_on_sheets(stages):
    """Texels of a sheet share no patch with others, and its hits lie on it."""
    hits, reference = stages.hits(), stages.reference
    sheets = reference.texel_sheets(stages.surfaces()).ravel()
    distance = np.linalg.norm(hits[:, :3].reshape(GRID.count, -1, 3) - reference.positions[:, None], axis=2).ravel()
    again = Patches(GRID)
    patch = again.bind(
        hits,
        distance.astype(np.float32),
        lambda items, patches: stages.sees_leader(hits[items], patches),
        row_length=8,
        sheets=sheets,
    )
    np.testing.assert_array_equal(stages.patch().ravel(), patch)
    np.testing.assert_array_equal(stages.sheets[patch[patch >= 0]], sheets[patch >= 0])
    assert set(sheets) == {0, 1, 2}
    np.testing.assert_allclose(hits[:, :3], reference.texel_hits(stages.surfaces()).reshape(-1, 4)[:, :3], atol=1e-6)


def test_direct_light_of_both_sides(stages):
    patches = np.arange(0, stages.light.count, 5)
    expected = stages.reference.light.direct_light(stages.points, patches, 3, sheets=stages.sheets)
    assert close(stages.direct_of(patches, 3), expected).mean() > 0.985
    one_side = stages.reference.light.direct_light(stages.points, patches, 3)
    assert close(one_side, expected).mean() < 0.8, "the comparison can fail"
    for part in ((0, 3),):
        mean, deviation = stages.reference.light.spread(stages.points, patches, part, stages.sheets)
        found = stages.spread(part)[:, patches]
        np.testing.assert_allclose(found[0], mean, rtol=1e-3, atol=1e-4 * mean.max())
        assert close(found[1], deviation, 1e-3).mean() > 0.99


@pytest.mark.parametrize("segments", [1, pytest.param(3, marks=pytest.mark.any_version)])
def test_rays_of_both_sides(stages, segments):
    first, count, rays_each = 40, 200, 8
    hits, brought, reflected = stages.rays(first, count, rays_each, segments)
    numbers = np.arange(first, first + count)
    rays = stages.reference.light.trace(stages.points, numbers, rays_each, segments, sheets=stages.sheets)
    same = np.abs(hits - rays.hits)[..., :3].max(axis=-1) < 1e-4
    assert same.mean() > 0.98
    assert (np.abs(reflected - rays.reflected).max(axis=-1) < 5e-3)[same].mean() > 0.98
    assert close(brought, rays.brought, 1e-3)[same.all(axis=1)].mean() > 0.96


@pytest.mark.any_version
def test_final_gather_on_sheets(stages):
    """Texels with light and paths of their own ask both sides as well."""
    stages.connect()
    stages.iterate(False)
    count = stages.gpu.count * 6 * 64
    found = read(stages.light.gather(stages.hits_texture(), count, 7), count)[:, :3]
    assert np.isfinite(found).all() and found.any()
    lit = stages.irradiance_at_texels(2).reshape(-1, 3)
    sheets = stages.reference.texel_sheets(stages.surfaces()).ravel()
    places = stages.hits()[:, None]
    chosen = np.flatnonzero((stages.hits()[:, 3] >= 0) & (sheets > 0))[::7]
    expected = stages.reference.light.direct_light(places, chosen, 2, sheets=sheets)
    assert close(lit[chosen], expected).mean() > 0.98
