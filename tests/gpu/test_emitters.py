# SPDX-License-Identifier: GPL-3.0-or-later
"""Small emissive surfaces, which are sampled like lamps, against closed forms and the reference."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.emitters import sampling_density
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import FROM_BEHIND, FROM_FRONT, Image, Material, World
from small_scenes import bake, box, furnace, irradiance_at_nodes, snapshot_of
from stages import Stages

RADIANCE = np.array([3.0, 2.0, 1.0])


def panel(half_x, half_y, height):
    """A rectangle facing down."""
    corners = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
    a, b, c, d = np.concatenate([corners, np.full((4, 1), height)], axis=1)
    return np.array([[a, c, b], [a, d, c]])


def room_with_panel(half_x=0.1, half_y=0.05, height=0.9, albedo=1.0, unseen_by=0):
    """A large room without a bounce to speak of and a lamp near its ceiling."""
    room = box((-4, -4, -1), (4, 4, 1))[:, ::-1]
    return snapshot_of(
        np.concatenate([room, panel(half_x, half_y, height)]),
        np.repeat([0, 1], [12, 2]),
        [Material("white", (albedo,) * 3), Material("lamp", (0.0,) * 3, emission=tuple(RADIANCE), unseen_by=unseen_by)],
        np.repeat([0, 1], [12, 2]),
    )


def grid(resolution=(3, 3, 2)):
    return Grid.from_bounds([-1.1, -0.9, -0.6], [0.8, 1.0, 0.5], resolution)


def test_a_small_lamp_is_sampled_by_area_and_luminance():
    snapshot = room_with_panel()
    density = sampling_density(snapshot, grid())
    np.testing.assert_array_equal(density[:12], 0)
    np.testing.assert_allclose(density[12:], 1 / (0.2 * 0.1), rtol=1e-9)
    assert not sampling_density(furnace(0.5), grid()).any(), "what glows all over is left to the field"


def factor_of_panel(x, y, height):
    """Form factor of the panel of ``room_with_panel`` from places x, y beneath or above it (Howell, B-4): four corners
    with sign."""

    def corner(width, depth):
        a, b = width / height, depth / height
        ra, rb = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
        return (a / ra * np.arctan(b / ra) + b / rb * np.arctan(a / rb)) / (2 * np.pi)

    return sum(corner(0.1 + sx * x, 0.05 + sy * y) for sx in (-1, 1) for sy in (-1, 1))


def test_light_of_a_small_lamp_on_the_floor():
    """E = π L F of a parallel rectangle seen from the floor."""
    stages = Stages(room_with_panel(), grid((2, 1, 1)), BakeSettings(keep_all=True, face=32))
    hits, irradiance = stages.hits(), stages.irradiance_at_texels(64).reshape(-1, 3)
    points = hits[:, :3] + stages.grid.center
    on_floor = (hits[:, 3] >= 0) & (points[:, 2] < -0.999) & (np.abs(points[:, :2]).max(axis=1) < 2)
    assert on_floor.sum() > 500
    factor = factor_of_panel(*points[on_floor, :2].T, 1.9)
    ratio = irradiance[on_floor] / (np.pi * factor[:, None] * RADIANCE)
    assert np.quantile(np.abs(ratio - 1), 0.95) < 0.03 and abs(ratio.mean() - 1) < 2e-3


def test_light_of_a_lamp_on_the_ceiling_right_above_it():
    """A hand's breadth and less from a surface a shadow ray, which starts a little off the surface, must not end in the
    lamp itself: the ceiling here would get none of its light."""
    stages = Stages(room_with_panel(height=0.97), grid((2, 1, 1)), BakeSettings(keep_all=True, face=32))
    hits, irradiance = stages.hits(), stages.irradiance_at_texels(256).reshape(-1, 3)
    points = hits[:, :3] + stages.grid.center
    above = (hits[:, 3] >= 0) & (points[:, 2] > 0.999) & (np.abs(points[:, :2]).max(axis=1) < 0.3)
    assert above.sum() > 30
    expected = np.pi * factor_of_panel(*points[above, :2].T, 0.03)[:, None] * RADIANCE
    np.testing.assert_allclose(irradiance[above].mean(axis=0), expected.mean(axis=0), rtol=0.03)


@pytest.mark.parametrize("unseen_by", [FROM_BEHIND, FROM_FRONT])
def test_a_lamp_that_shines_to_one_side(unseen_by):
    """It faces down. The lit side gets what it gets of a whole one, floor and ceiling, probes below and above."""
    volume = Grid.from_bounds([0.3, 0.1, -0.5], [0.5, 0.3, 0.95], (1, 1, 2))
    settings = BakeSettings(keep_all=True, face=32, bounces=0)
    whole, one = (room_with_panel(height=0.5, unseen_by=sides) for sides in (0, unseen_by))
    lit, dark = (-0.999, 0.999) if unseen_by == FROM_BEHIND else (0.999, -0.999)
    light = {}
    for name, snapshot in (("whole", whole), ("one", one)):
        stages = Stages(snapshot, volume, settings)
        hits, irradiance = stages.hits(), stages.irradiance_at_texels(64).reshape(-1, 3)
        height = (hits[:, :3] + stages.grid.center)[:, 2]
        near = (hits[:, 3] >= 0) & (np.abs((hits[:, :3] + stages.grid.center)[:, :2]).max(axis=1) < 2)
        for where in (lit, dark):
            light[name, where] = irradiance[near & (np.abs(height - where) < 2e-3)].mean(axis=0)
    np.testing.assert_allclose(light["one", lit], light["whole", lit], rtol=0.02)
    assert not light["one", dark].any() and light["whole", dark].all()
    black = [
        replace(snapshot, materials=[Material("black", (0.0,) * 3), snapshot.materials[1]]) for snapshot in (whole, one)
    ]
    fields = [bake(snapshot, volume, settings).field.coefficients[:, 0, 0] for snapshot in black]
    bright = 0 if unseen_by == FROM_BEHIND else 1
    assert (
        fields[1][bright] == pytest.approx(fields[0][bright], rel=0.01) and fields[1][1 - bright] == 0 < fields[0].min()
    )


def room_with_pictures(sides=False):
    """A room with three small things that glow: a picture, a net with holes, a panel beside the wall; two of them from
    one of their ``sides`` alone."""
    generator = np.random.default_rng(2)
    noise = Image("noise", generator.random((8, 8, 4)).astype(np.float32))
    holes = np.ones((4, 4, 4), np.float32)
    holes[..., 3] = generator.random((4, 4)) < 0.6
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    parts = [
        box((-1.1, -1.2, -0.9), (1.3, 1.1, 1.0))[:, ::-1],
        panel(0.15, 0.1, 0.0) @ turn + [0.5, 0.3, 0.4],
        panel(0.2, 0.2, 0.7) + [-0.4, -0.5, 0.0],
        panel(0.3, 0.05, -0.88),
    ]
    index = np.repeat([0, 1, 2, 3], [12, 2, 2, 2])
    materials = [
        Material("wall", (0.7, 0.6, 0.5)),
        Material("picture", (0.3, 0.3, 0.3), emission=(5.0, 4.0, 3.0), emission_image=0),
        Material(
            "net",
            (0.5,) * 3,
            emission=(1.0, 3.0, 1.0),
            alpha_image=1,
            alpha_threshold=0.5,
            unseen_by=sides and FROM_FRONT,
        ),
        Material("panel", (0.0, 0.0, 0.0), emission=(2.0, 2.0, 6.0), unseen_by=sides and FROM_BEHIND),
    ]
    uvs = generator.uniform(0, 1, (18, 3, 2))
    images = [noise, Image("holes", holes, "EXTEND")]
    return snapshot_of(np.concatenate(parts), index, materials, index, uvs, images=images)


def pictures(sides=False, **settings):
    volume = Grid.from_bounds([-0.8, -0.9, -0.6], [1.0, 0.8, 0.7], (3, 2, 2))
    return Stages(room_with_pictures(sides), volume, BakeSettings(keep_all=True, face=8, seed=3, **settings))


@pytest.mark.parametrize(("samples", "sides"), [(5, False), (16, False), (16, True)])
def test_points_and_directions_against_the_reference(samples, sides):
    stages = pictures(sides)
    patches = np.arange(0, stages.light.count, 5)
    found = stages.direct_of(patches, samples)
    expected = stages.reference.light.direct_light(stages.points, patches, samples)
    error = np.abs(found - expected).max(axis=1) / expected.max()
    # the rest: rays that graze an edge or a hole, and a choice among candidates that rounding tips
    assert (error < 1e-5).mean() > 0.95 and (error < 0.02).mean() > 0.995
    assert found.sum() == pytest.approx(expected.sum(), rel=5e-3)


def test_paths_lit_by_emitters_against_the_reference():
    stages = pictures()
    _hits, brought, _reflected = stages.rays(0, 150, 4, 2)
    expected = stages.reference.light.trace(stages.points, np.arange(150), 4, 2).brought
    assert (np.abs(brought - expected).max(axis=1) < 1e-4 * expected.max()).mean() > 0.95
    assert brought.sum() == pytest.approx(expected.sum(), rel=5e-3)


def test_what_probes_see_of_emitters_against_the_reference():
    """Which point gets a ray hangs on a running sum: where rounding tips it, the next point gets the ray."""
    stages = pictures(bands=4)
    stages.connect()
    stages.iterate(False)
    found = stages.project_emitters()
    expected = stages.reference.project_emitters(stages.surfaces())
    assert (expected[:, 0] > 0.01).all()
    np.testing.assert_allclose(found, expected, atol=2e-3 * expected.max())
    np.testing.assert_allclose(found[:, 0], expected[:, 0], rtol=2e-3)


@pytest.mark.parametrize("half", [0.02, 0.1, 0.4])
def test_a_probe_sees_a_lamp_smaller_than_its_texels(half):
    """Band 0 of a lamp is Y₀₀ L Ω, Ω of a rectangle 4·atan2(ab, h √(a² + b² + h²)) below its middle, by signs
    elsewhere."""
    snapshot = room_with_panel(half, half, albedo=0.0)
    volume = grid()
    result = bake(snapshot, volume, BakeSettings(keep_all=True, face=8))
    x, y, z = volume.positions().T
    height = 0.9 - z

    def corner(a, b):
        return np.arctan2(a * b, height * np.sqrt(a * a + b * b + height * height))

    solid_angle = sum(corner(half + sx * x, half + sy * y) for sx in (-1, 1) for sy in (-1, 1))
    expected = 0.28209479177387814 * solid_angle[:, None] * RADIANCE
    found = result.field.coefficients[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0.1)
    np.testing.assert_allclose(found.sum(axis=0), expected.sum(axis=0), rtol=0.02)


def test_traced_bounces_see_the_world():
    """A grey box under a uniform sky, in a probe above: L of the sky, and albedo · L where a convex body is lit by all
    of it."""
    snapshot = snapshot_of(
        box((-0.5, -0.5, -2), (0.5, 0.5, -1)),
        materials=[Material("grey", (0.5, 0.5, 0.5))],
        world=World((1.0, 1.0, 1.0)),
    )
    volume = Grid.from_bounds([-0.2] * 3, [0.2] * 3, (2, 2, 2))
    result = bake(snapshot, volume, BakeSettings(gather=1, keep_all=True, samples=64))
    found = irradiance_at_nodes(result.field, np.array([[0, 0, 1.0], [0, 0, -1.0]]))
    np.testing.assert_allclose(found[:, 0], 1, atol=0.02)
    assert (found[:, 1] < 0.95).all() and (found[:, 1] > 0.5).all()
