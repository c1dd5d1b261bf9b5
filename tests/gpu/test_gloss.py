# SPDX-License-Identifier: GPL-3.0-or-later
"""Glossy surfaces: closed forms, and every stage that knows them against its twin."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.emitters import sampling_density
from gridlight.core.gloss import TEXEL_RAYS, Gloss
from gridlight.core.grid import Grid
from gridlight.core.patches import NO_PATCH
from gridlight.core.reference_gloss import TexelReflections
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from gridlight.gpu_shaders.textures import read
from small_scenes import all_lights, bake, box, cluttered_room, frame, furnace, snapshot_of, with_small_emitter
from stages import Stages

GRID = Grid.from_bounds([-0.6, -0.5, -0.1], [0.7, 0.5, 0.1], (2, 2, 1))
WHITE = (1.0, 1.0, 1.0)
SURFACES = {
    "mirror": Gloss(WHITE, WHITE, 0.0),
    "rough metal": Gloss(WHITE, WHITE, 0.6),
    "coat": Gloss((0.1, 0.1, 0.1), (0.04, 0.04, 0.04), 0.1),
    "half": Gloss((0.5, 0.5, 0.5), (0.3, 0.3, 0.3), 0.3),
}


def mean_radiance(field):
    return field.coefficients[:, 0] / (2 * np.sqrt(np.pi))


@pytest.mark.any_version
@pytest.mark.parametrize(("name", "gather"), [("mirror", 0), ("rough metal", 1), ("coat", 0), ("half", 0)])
def test_furnace_with_gloss(name, gather):
    """What sends back all light is not seen in a furnace, however it does so."""
    closed = furnace(0.8, inward=True)
    piece = box((-0.3, -0.2, -0.25), (0.2, 0.1, 0.35))
    corners = np.concatenate([closed.triangle_positions, piece])
    material = np.arange(len(corners)) >= len(corners) - len(piece)
    materials = [*closed.materials, Material("piece", WHITE, gloss=SURFACES[name])]
    snapshot = snapshot_of(corners, material.astype(int), materials)
    grid = Grid.from_bounds([-0.7, -0.7, -0.7], [0.7, 0.7, 0.7], (2, 2, 2))
    found = bake(snapshot, grid, BakeSettings(keep_all=True, tolerance=1e-4, gather=gather)).field
    np.testing.assert_allclose(mean_radiance(found), 5.0, rtol=2e-3)
    scene = SceneTextures(snapshot, grid.center, np.zeros(len(snapshot.triangles)))
    flux = ProbePaths(scene, snapshot, grid, grid.positions()).trace(0, 128, None, 1)[1]
    assert flux.mean(axis=(0, 1)).sum(axis=0) / 128 / (4 * np.pi) == pytest.approx(np.full(3, 5.0), rel=0.03)


PANEL = np.array(
    [
        [(-1.6, -0.6, 0.99), (-1.6, 0.2, 0.99), (-0.9, 0.2, 0.99)],
        [(-1.6, -0.6, 0.99), (-0.9, 0.2, 0.99), (-0.9, -0.6, 0.99)],
    ]
)
LAMP = Light("panel", "AREA", (3.0, 2.5, 2.0), frame((-1.25, -0.2, 0.99)), size_x=0.8, size_y=0.7)
BULB = box((-1.5, 0.4, 0.2), (-1.46, 0.43, 0.23))
GLOWING = {"panel": (PANEL, (3.0, 2.5, 2.0)), "bulb": (BULB, (60.0, 50.0, 40.0))}


def room_beside_mirror(light, mirrored, lamp=False):
    """A room from x = −2 to 0 with a pillar, lit by the glowing thing ``light``, which may be a ``lamp``; at x = 0 a
    mirror, or without one the room's mirror image."""
    walls, pillar = box((-2, -1, -1), (0, 1, 1))[:, ::-1], box((-0.9, -0.3, -1), (-0.6, 0.4, 0.5))
    at_zero = (np.abs(walls[..., 0]) < 1e-9).all(axis=1)
    left = (np.abs(walls[..., 0] + 2) < 1e-9).all(axis=1)
    glowing, radiance = GLOWING[light]
    glowing = np.zeros((0, 3, 3)) if lamp else glowing
    pieces = np.concatenate([walls[~at_zero], pillar, glowing])
    material = np.concatenate([left[~at_zero].astype(int), np.zeros(len(pillar), int), np.full(len(glowing), 2)])
    materials = [
        Material("grey", (0.6, 0.6, 0.6)),
        Material("red", (0.7, 0.2, 0.1)),
        Material("glowing", (0.0, 0.0, 0.0), emission=radiance),
        Material("mirror", WHITE, gloss=SURFACES["mirror"]),
    ]
    beyond, its_material = walls[at_zero], np.full(2, 3)
    if not mirrored:
        image = np.concatenate([walls[~at_zero], pillar, GLOWING[light][0]])
        beyond = image[:, ::-1] * [-1, 1, 1]
        its_material = np.concatenate([material[: len(pieces) - len(glowing)], np.full(len(GLOWING[light][0]), 2)])
    material = np.concatenate([material, its_material])
    corners = np.concatenate([pieces, beyond])
    return snapshot_of(corners, material, materials, (material == 2).astype(int), lights=[LAMP] if lamp else [])


@pytest.mark.any_version
@pytest.mark.parametrize(
    ("light", "lamp"), [pytest.param("panel", False, marks=pytest.mark.nightly), ("panel", True), ("bulb", False)]
)
def test_mirror_shows_the_room_again(light, lamp):
    """A wall that is a mirror is the room's mirror image."""
    grid = Grid.from_bounds([-1.8, -0.8, -0.8], [-0.2, 0.8, 0.8], (3, 3, 3))
    settings = BakeSettings(keep_all=True, samples=2)
    found, expected = (bake(room_beside_mirror(light, m, lamp), grid, settings).field for m in (True, False))
    here, there = found.coefficients, expected.coefficients
    error = np.sqrt(((here - there) ** 2).sum() / (there**2).sum())
    bias = here[:, 0].mean() / there[:, 0].mean() - 1
    assert error < 0.07 and abs(bias) < 0.015
    snapshot = room_beside_mirror(light, True, lamp)
    scene = SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
    flux = ProbePaths(scene, snapshot, grid, grid.positions()).trace(0, 64, None, 1)[1]
    assert flux.mean(axis=(0, 1)).sum(axis=0).mean() / 64 / np.sqrt(4 * np.pi) == pytest.approx(
        here[:, 0].mean(), rel=0.03
    )


# Stages
# ----------------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def stages(gpu_context):
    """A cluttered room with gloss of all kinds, sheets, lamps of all kinds and a small glowing triangle."""
    chosen = ("point", "point soft", "point sphere", "spot soft", "sun wide", "rectangle", "spread", "profiled")
    lights = [all_lights()[name] for name in chosen]
    room = with_small_emitter(cluttered_room({light.name: light for light in lights}))
    materials = list(room.materials)
    kinds = {
        0: SURFACES["coat"],
        1: Gloss((0.8, 0.7, 0.6), (0.7, 0.6, 0.5), 0.5),
        2: SURFACES["mirror"],
        4: SURFACES["half"],
    }
    for number, gloss in kinds.items():
        materials[number] = Material(**{**vars(materials[number]), "gloss": gloss})
    materials[0] = Material(
        **{**vars(materials[0]), "gloss": Gloss((0.1, 0.1, 0.1), (0.04, 0.04, 0.04), 0.1, fixed=True)}
    )
    materials[5] = Material(**{**vars(materials[5]), "transmitted": (0.5, 0.2, 0.1), "tint": (0.9, 0.5, 0.3)})
    return Stages(replace(room, materials=materials), GRID, BakeSettings(face=8, keep_all=True, seed=5, bounces=0))


def close(found, expected, tolerance):
    scale = np.quantile(np.abs(expected), 0.999)
    return (np.abs(found - expected) <= tolerance * scale).reshape(*expected.shape[:-1], -1).all(axis=-1)


@pytest.fixture(scope="module")
def reflected(stages):
    """Texel reflections of the GPU, (P, X, K + 1, 4), and of the reference for what the GPU captured."""
    surfaces, captured = stages.surfaces(), stages.reference.capture()
    surfaces.albedo = np.where((surfaces.triangle == captured.triangle)[..., None], captured.albedo, surfaces.albedo)
    expected = stages.reference.reflections(surfaces)
    texels = stages.gpu.count * 6 * 64
    found = read(stages.gpu.textures["mirrored"], texels * (TEXEL_RAYS + 1)).reshape(
        stages.gpu.count, -1, TEXEL_RAYS + 1, 4
    )
    return found, expected, surfaces, surfaces.triangle == captured.triangle


def test_what_texels_mirror(stages, reflected):
    found, expected, surfaces, same = reflected
    glossy = stages.reference.light.gloss.is_glossy(surfaces.triangle) & same
    assert 0.2 < glossy.mean() < 0.9
    assert close(stages.surfaces().albedo, expected.diffuse, 1e-3)[glossy].mean() > 0.99
    assert close(found[:, :, 0, :3], expected.carried, 2e-3)[glossy].mean() > 0.93
    assert not found[~glossy & same][:, :, :3].any()
    counted = np.maximum((found[:, :, 1:, 3] != NO_PATCH).sum(axis=2), 1)[..., None, None]
    sent = expected.sent.reshape(found[:, :, 1:, :3].shape)
    assert close(found[:, :, 1:, :3] * counted, sent, 5e-3)[glossy].mean() > 0.96
    assert sent[glossy].any(axis=-1).mean() > 0.3, "rays end on surfaces"


def test_what_probes_see_mirrored_counts_as_seen(stages, reflected):
    found, patches = reflected[0], stages.light.patches
    patches.forget_seen()
    patches.mark_seen(stages.gpu.textures, 8, np.array([1, 2]), stages.backend.gloss.defines)
    ends = np.concatenate([found[1:3, :, 1:, 3].ravel(), stages.patch()[1:3].ravel()])
    expected = np.zeros(patches.count, bool)
    expected[ends[ends >= 0].astype(int)] = True
    np.testing.assert_array_equal(patches.read_seen(), expected)
    assert 0 < expected.sum() < patches.count


@pytest.mark.parametrize("segments", [1, pytest.param(3, marks=pytest.mark.any_version)])
def test_rays_that_are_mirrored(stages, segments):
    first, count, rays_each = 40, 200, 8
    stages.direct()
    hits, brought, reflected = stages.rays(first, count, rays_each, segments)
    reference = stages.reference.light
    rays = reference.trace(stages.points, np.arange(first, first + count), rays_each, segments, sheets=stages.sheets)
    same = np.abs(hits - rays.hits)[..., :3].max(axis=-1) < 1e-3
    assert same.mean() > 0.95
    assert (np.abs(reflected - rays.reflected).max(axis=-1) < 5e-3)[same].mean() > 0.97
    assert close(brought, rays.brought, 2e-3)[same.all(axis=1)].mean() > 0.9


def test_field_with_what_is_mirrored(stages, reflected):
    """The projection reads both parts of a texel's light."""
    found, expected, surfaces, _same = reflected
    stages.connect()
    irradiance, *_ = stages.iterate(False)
    ends = found[:, :, 1:, 3].astype(int).ravel()
    gpu_sent = TexelReflections(
        expected.diffuse,
        found[:, :, 0, :3].astype(float),
        expected.ways,
        (found[:, :, 1:, :3] * np.maximum((found[:, :, 1:, 3] != NO_PATCH).sum(axis=2), 1)[..., None, None]).reshape(
            -1, 3
        ),
    )
    seen = stages.surfaces()
    light = stages.reference.reflected(seen, stages.patch(), irradiance)
    mirrored = stages.reference.mirrored(gpu_sent, ends, irradiance)
    projected = stages.project()
    np.testing.assert_allclose(
        projected, stages.reference.project(seen, light + mirrored), rtol=1e-4, atol=1e-4 * projected.max()
    )
    without = stages.reference.project(seen, light)
    assert np.abs(projected - without).max() > 0.05 * projected.max(), "the comparison can fail"
