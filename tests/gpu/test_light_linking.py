# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: scenes that are the same without it, and every stage that knows it against its twin."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.core.light_links import Links
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import SHADOW_RAYS, Light, Material, World
from gridlight.gpu_shaders.probe_paths import ProbePaths
from gridlight.gpu_shaders.scene_textures import SceneTextures
from small_scenes import all_lights, bake, box, cluttered_room, frame, snapshot_of
from stages import Stages

GRID = Grid.from_bounds([-0.6, -0.5, -0.5], [0.7, 0.5, 0.4], (3, 2, 2))
BELOW = Grid.from_bounds([-0.5, -0.5, 0.2], [0.5, 0.5, 0.8], (1, 1, 1))


def plane(z, half):
    corners = np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def scene(floor=Links(), screen=Links(), bulb=0, lamp=200.0, glow=0.0, unseen_by=0):
    """A white floor under a lamp of group 1 and a glowing cube of group ``bulb``, a black screen between."""
    corners = np.concatenate([plane(0.0, 5.0), plane(2.0, 2.0), box((-0.1, -0.1, 2.9), (0.1, 0.1, 3.1))])
    materials = [
        Material("white", (1.0,) * 3, links=floor),
        Material("black", (0.0,) * 3, links=screen, unseen_by=unseen_by),
        Material("bulb", (0.0,) * 3, emission=(glow,) * 3, links=Links(group=bulb), unseen_by=SHADOW_RAYS),
    ]
    lamps = [Light("lamp", "POINT", (lamp,) * 3, frame((0, 0, 4)), link_group=1)] if lamp else []
    objects = [0, 0, 1, 1, *[2] * 12]
    return snapshot_of(corners, objects, materials, objects, lights=lamps, world=World((0.1,) * 3))


def field_below(snapshot):
    return bake(snapshot, BELOW, BakeSettings(keep_all=True, face=16, bounces=1, samples=2)).field.coefficients


def test_light_falls_on_receivers_only():
    """A floor that is none is lit as if there were no lamp."""
    unlit = field_below(scene(floor=Links(unlit_by=1)))
    np.testing.assert_allclose(unlit, field_below(scene(lamp=0.0)), atol=1e-6)
    assert field_below(scene())[0, 0, 0] > 1.1 * unlit[0, 0, 0], "the comparison can fail"
    np.testing.assert_array_equal(field_below(scene(floor=Links(unlit_by=2))), field_below(scene()))


def test_what_is_no_blocker_casts_no_shadow():
    passed = field_below(scene(screen=Links(passed_by=1)))
    np.testing.assert_allclose(passed, field_below(scene(unseen_by=SHADOW_RAYS)), rtol=1e-5, atol=1e-7)
    assert passed[0, 2, 0] < field_below(scene())[0, 2, 0] - 0.05, "more light comes from below"


def test_glowing_objects_are_linked_as_well():
    """What the floor gets of the light, apart from what a probe sees of the cube, which is not linked."""
    glowing = {"lamp": 0.0, "glow": 200.0, "bulb": 1}
    unlit, lit = field_below(scene(floor=Links(unlit_by=1), **glowing)), field_below(scene(**glowing))
    np.testing.assert_allclose(unlit, field_below(scene(lamp=0.0)), atol=1e-6)
    floor = []
    for way in ({"screen": Links(passed_by=1)}, {"unseen_by": SHADOW_RAYS}):
        with_light, without = (
            field_below(scene(floor=links, **way, **glowing))[0, 0, 0] for links in (Links(), Links(unlit_by=1))
        )
        floor.append(with_light - without)
    np.testing.assert_allclose(floor[0], floor[1], rtol=0.02)
    assert floor[0] > 2 * (lit - unlit)[0, 0, 0]


def test_paths_agree():
    """What --error measures by follows links as well."""
    for links in ({"floor": Links(unlit_by=1)}, {"screen": Links(passed_by=1)}):
        snapshot = scene(**links)
        textures = SceneTextures(snapshot, BELOW.center, np.zeros(len(snapshot.triangles)))
        flux = ProbePaths(textures, snapshot, BELOW, BELOW.positions()).trace(0, 2048, 1, 1)[1]
        mean = flux.mean(axis=0).sum(axis=1) / 2048 / (4 * np.pi)
        np.testing.assert_allclose(mean, field_below(snapshot)[:, 0] / (2 * np.sqrt(np.pi)), rtol=0.05)


@pytest.fixture(scope="module")
def stages(gpu_context):
    """A cluttered room with two groups of lamps, one of glowing surfaces, and surfaces that know of them."""
    lights = {name: all_lights()[name] for name in ("point", "sun wide", "rectangle")}
    snapshot = cluttered_room(lights)
    for number, group in ((0, 1), (2, 2)):
        snapshot.lights[number] = replace(snapshot.lights[number], link_group=group)
    for number, links in ((0, Links(unlit_by=1)), (4, Links(passed_by=3)), (5, Links(unlit_by=4, passed_by=1))):
        snapshot.materials[number] = replace(snapshot.materials[number], links=links)
    for number, material in enumerate(snapshot.materials):
        if any(material.emission):
            snapshot.materials[number] = replace(material, links=replace(material.links, group=3))
    return Stages(snapshot, GRID, BakeSettings(face=8, keep_all=True, seed=5))


def close(found, expected, tolerance=1e-5):
    return (np.abs(found - expected) <= tolerance * np.abs(expected).max()).reshape(len(expected), -1).all(axis=1)


def test_direct_light_agrees(stages):
    patches = np.arange(0, stages.light.count, 5)
    reference = stages.reference.light
    expected = reference.direct_light(stages.points, patches, 3, sheets=stages.sheets)
    assert close(stages.direct_of(patches, 3), expected).mean() > 0.985
    assert close(reference.direct_light(stages.points, patches, 3), expected).mean() < 0.9, "the comparison can fail"
    mean, _deviation = reference.spread(stages.points, patches, (0, 3), stages.sheets)
    np.testing.assert_allclose(stages.spread((0, 3))[0, patches], mean, rtol=1e-3, atol=1e-4 * mean.max())


@pytest.mark.parametrize("segments", [1, 3])
def test_rays_agree(stages, segments):
    first, count, rays_each = 40, 200, 8
    hits, brought, _reflected = stages.rays(first, count, rays_each, segments)
    numbers = np.arange(first, first + count)
    rays = stages.reference.light.trace(stages.points, numbers, rays_each, segments, sheets=stages.sheets)
    same = (np.abs(hits - rays.hits)[..., :3].max(axis=-1) < 1e-4).all(axis=1)
    assert same.mean() > 0.9
    assert close(brought, rays.brought, 1e-3)[same].mean() > 0.96
