# SPDX-License-Identifier: GPL-3.0-or-later
"""Gloss that is sent in all directions: every stage that knows it against its twin, and a bake against paths."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core import reference_highlights
from gridlight.core import spherical_harmonics as sh
from gridlight.core.emitters import sampling_density
from gridlight.core.gloss import Gloss
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material
from gridlight.gpu_shaders.highlight_pass import EndedRays, add_highlights, find_highlights
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from gridlight.gpu_shaders.textures import allocate, numbers, read
from small_scenes import (
    all_lights,
    bake,
    box,
    cluttered_room,
    frame,
    irradiance_at_nodes,
    snapshot_of,
    with_small_emitter,
)
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


def light_by_part(stages):
    """What the GPU found that each part of the light does to patches, for the twin as well."""
    stages.direct()
    count, light = stages.light.count, stages.reference.light
    light.direct_by_part = {
        part: (read(values, count)[:, :3].astype(float), read(spread, count, channels=2)[:, 0].astype(float))
        for part, values, spread in stages.light.direct_by_part()
    }
    return count


def test_highlights_of_texels(stages):
    light_by_part(stages)
    nodes, surfaces = np.arange(stages.gpu.count), stages.surfaces()
    backend, listed = stages.backend, numbers(np.arange(stages.gpu.count), "test")
    backend.allocate_field()
    where = backend.probe_slots, 0, stages.gpu.textures, (listed, len(nodes))
    parts = stages.light.direct_by_part()
    add_highlights(backend.scene, stages.settings, where, backend._texel_weights, parts, backend._field, 64)
    found, reference = backend.read_field(), stages.reference
    sent = reference.highlights(surfaces, stages.patch())
    expected = sh.project(sent, reference.directions, reference.solid_angles, stages.settings.bands)
    assert np.abs(expected).max() > 0.01, "there are some"
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())


def test_highlights_where_rays_end(stages):
    found = stages.connect()
    count = light_by_part(stages)
    light = stages.reference.light
    light.patches.points = stages.points
    result, places = allocate(count, "test"), stages.light.patches.places
    rays = stages.light
    ended = EndedRays(places, count, rays._rays_each, rays._ends.texture, rays._reflected.texture)
    find_highlights(stages.backend.scene, stages.settings.seed, ended, places, rays.direct_by_part(), result)
    expected = light.highlights_of(reference_highlights.EndedRays(found.ends, found.reflected))
    result = read(result, count)[:, :3]
    assert close(result, expected, 2e-2).mean() > 0.97
    direct = read(stages.light.direct, count)[:, :3]
    assert np.abs(expected).max() > 0.01 * direct.max(), "there are some"


@pytest.mark.any_version
def test_it_is_nearly_what_following_it_finds(gpu_context):
    """The same plastic in both ways under two lamps and a small emitter: by rays, and by highlights."""
    walls = box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))[:, ::-1]
    glowing = box((-0.7, -0.9, 0.3), (-0.6, -0.8, 0.4))
    lamps = [
        Light("lamp", "AREA", (9.0, 9.0, 9.0), frame((0.0, 0.3, 0.95)), size_x=0.3, size_y=0.3),
        Light("spot", "POINT", (0.6, 0.3, 0.1), frame((0.6, -0.5, 0.2)), radius=0.05),
    ]
    grid = Grid.from_bounds([-0.6] * 3, [0.6] * 3, (2, 2, 2))
    gloss = replace(PLASTIC, share=(0.056, 0.056, 0.056))

    def irradiance(**kind):
        materials = [Material("plastic", (0.25, 0.2, 0.2), **kind), Material("glowing", (0, 0, 0), (20.0, 20.0, 20.0))]
        corners, material = np.concatenate([walls, glowing]), [0] * len(walls) + [1] * len(glowing)
        snapshot = snapshot_of(corners, material, materials, lights=lamps)
        return irradiance_at_nodes(bake(snapshot, grid, BakeSettings(keep_all=True, face=8)).field)

    followed, sent, none = irradiance(gloss=gloss), irradiance(faint_gloss=gloss), irradiance()
    scale = np.sqrt((followed**2).mean())
    assert np.sqrt(((sent - followed) ** 2).mean()) < 0.02 * scale
    assert np.sqrt(((none - followed) ** 2).mean()) > 0.06 * scale, "it makes a difference"


@pytest.mark.any_version
def test_a_ball_far_off_sends_light(gpu_context):
    """Normals turn by more than a lobe is wide within one texel that shows a ball; what it sends in all stays."""
    ball = box((-0.3, -0.3, -0.3), (0.3, 0.3, 0.3))
    lamp = Light("sun", "SUN", (3.0, 3.0, 3.0), frame((0.3, 0.2, 0.9)), angle=0.01)
    grid = Grid.from_bounds([-4.0] * 3, [4.0] * 3, (3, 3, 3))

    def seen(**gloss):
        snapshot = snapshot_of(ball, materials=[Material("metal", (0.63, 0.63, 0.08), **gloss)], lights=[lamp])
        round_normals = ball / np.linalg.norm(ball, axis=2, keepdims=True)
        snapshot = replace(snapshot, corner_normals=round_normals.astype(np.float32))
        field = bake(snapshot, grid, BakeSettings(keep_all=True, face=4)).field
        return np.delete(field.coefficients[:, 0], 13, axis=0)  # without the one inside

    metal = Gloss((0.63, 0.63, 0.08), (0.7, 0.7, 0.1), 0.7, fixed=True)
    sent, evenly = seen(faint_gloss=metal), seen()
    assert (sent >= 0).all()
    assert 0.6 < sent.sum() / evenly.sum() < 1.6


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
