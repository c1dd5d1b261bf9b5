# SPDX-License-Identifier: GPL-3.0-or-later
"""Gloss that is sent in all directions: every stage that knows it against its twin, and a bake against paths."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.emitters import sampling_density
from gridlight.core.gloss import Gloss
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from small_scenes import all_lights, bake, box, cluttered_room, frame, snapshot_of, with_small_emitter
from stages import Stages

GRID = Grid.from_bounds([-0.6, -0.5, -0.1], [0.7, 0.5, 0.1], (2, 2, 1))
PLASTIC = Gloss((0.06, 0.06, 0.06), (0.04, 0.04, 0.04), 0.5, fixed=True)
SATIN = Gloss((0.5, 0.4, 0.3), (0.6, 0.5, 0.4), 0.8)


@pytest.fixture(scope="module")
def stages(gpu_context):
    """A cluttered room in which most is of plastic or satin."""
    lights = [all_lights()[name] for name in ("point soft", "spot soft", "sun wide", "rectangle")]
    room = with_small_emitter(cluttered_room({light.name: light for light in lights}))
    materials = list(room.materials)
    for number, gloss in ((0, PLASTIC), (1, PLASTIC), (2, SATIN), (4, SATIN)):
        materials[number] = replace(materials[number], faint_gloss=gloss)
    return Stages(replace(room, materials=materials), GRID, BakeSettings(face=8, keep_all=True, seed=5, bounces=0))


def close(found, expected, tolerance):
    scale = np.quantile(np.abs(expected), 0.99)
    return (np.abs(found - expected) <= tolerance * scale).reshape(len(expected), -1).all(axis=-1)


def plain(stages):
    """The reference's scene without gloss."""
    scene = stages.reference.scene
    return replace(scene.snapshot, materials=[replace(m, faint_gloss=None) for m in scene.snapshot.materials])


def test_texels_send_by_the_view(stages):
    found, expected = stages.surfaces(), stages.reference.capture()
    same = (found.triangle == expected.triangle) & (found.triangle >= 0)
    assert close(found.albedo[same], expected.albedo[same], 2e-3).mean() > 0.99
    scene, whole = stages.reference.scene, stages.reference.scene.snapshot
    scene.snapshot = plain(stages)
    even = stages.reference.capture()
    scene.snapshot = whole
    assert np.abs(even.albedo - expected.albedo)[same].max() > 0.05, "it makes a difference"


def test_direct_light_of_lamps_and_emitters(stages):
    patches, samples = np.arange(0, stages.light.count, 7), 4
    found = stages.direct_of(patches, samples)
    reference, points = stages.reference.light, stages.points
    expected = reference.direct_light(points, patches, samples)
    assert close(found, expected, 2e-3).mean() > 0.97
    scene, whole = stages.reference.scene, stages.reference.scene.snapshot
    scene.snapshot = plain(stages)
    even = reference.direct_light(points, patches, samples)
    scene.snapshot = whole
    assert close(found, even, 2e-3).mean() < 0.7, "it makes a difference"


@pytest.mark.parametrize("segments", [1, 3])
def test_rays(stages, segments):
    first, count, rays_each = 40, 150, 8
    stages.direct()
    hits, brought, reflected = stages.rays(first, count, rays_each, segments)
    rays = stages.reference.light.trace(stages.points, np.arange(first, first + count), rays_each, segments)
    same = np.abs(hits - rays.hits)[..., :3].max(axis=-1) < 1e-3
    assert same.mean() > 0.95
    # Where paths bounce the twin asks another mip level how much gloss there is beside a texture.
    alike = (np.abs(reflected - rays.reflected).max(axis=-1) < 5e-3)[same].mean()
    assert alike > (0.97 if segments == 1 else 0.92)
    assert close(brought, rays.brought, 1e-2)[same.all(axis=1)].mean() > 0.9


@pytest.mark.any_version
@pytest.mark.parametrize("gather", [0, 1])
def test_a_bake_holds_what_paths_find(gpu_context, gather):
    """A room of dark plastic under a lamp, where a lamp overhead counts a sixth less than light from everywhere."""
    gloss = replace(PLASTIC, share=(0.056, 0.056, 0.056))
    walls = box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))[:, ::-1]
    lamp = Light("lamp", "AREA", (9.0, 9.0, 9.0), frame((0.0, 0.0, 0.95)), size_x=0.3, size_y=0.3)
    plastic, matte = Material("plastic", (0.1, 0.1, 0.1), faint_gloss=gloss), Material("matte", (0.1, 0.1, 0.1))
    grid = Grid.from_bounds([-0.6] * 3, [0.6] * 3, (2, 2, 2))
    means = []
    for material in (plastic, matte):
        snapshot = snapshot_of(walls, materials=[material], lights=[lamp])
        settings = BakeSettings(keep_all=True, samples=2, gather=gather)
        found = bake(snapshot, grid, settings).field.coefficients[:, 0].mean()
        scene = SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
        flux = ProbePaths(scene, snapshot, grid, grid.positions()).trace(0, 512, None, 1)[1]
        paths = flux.mean(axis=(0, 1)).sum(axis=0).mean() / 512 / np.sqrt(4 * np.pi)
        assert found == pytest.approx(paths, rel=0.02)
        means.append(found)
    assert means[0] < 0.95 * means[1], "it makes a difference"
