# SPDX-License-Identifier: GPL-3.0-or-later
"""Small emissive surfaces, which are sampled like lamps, and traced bounces (``gather``), against closed forms."""

import numpy as np
import pytest
from gridlight.core.emitters import sampling_density
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Material, World
from small_scenes import bake, box, furnace, irradiance_at_nodes, snapshot_of
from stages import Stages

RADIANCE = np.array([3.0, 2.0, 1.0])


def panel(half_x, half_y, height):
    """A rectangle facing down."""
    corners = np.array([[-half_x, -half_y], [half_x, -half_y], [half_x, half_y], [-half_x, half_y]])
    a, b, c, d = np.concatenate([corners, np.full((4, 1), height)], axis=1)
    return np.array([[a, c, b], [a, d, c]])


def room_with_panel(half_x=0.1, half_y=0.05, height=0.9, albedo=1.0):
    """A large room without a bounce to speak of and a lamp near its ceiling."""
    room = box((-4, -4, -1), (4, 4, 1))[:, ::-1]
    return snapshot_of(
        np.concatenate([room, panel(half_x, half_y, height)]),
        np.repeat([0, 1], [12, 2]),
        [Material("white", (albedo,) * 3), Material("lamp", (0.0, 0.0, 0.0), emission=tuple(RADIANCE))],
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


def test_light_of_a_small_lamp_on_the_floor():
    """E = π L F of a parallel rectangle seen from the floor (Howell, B-4): four corners with sign. The floor is white:
    E = π · source."""
    stages = Stages(room_with_panel(), grid((2, 1, 1)), BakeSettings(keep_all=True, samples=64, face=32))
    stages.statistics()
    surfaces, source = stages.surfaces(), stages.source()
    points = stages.reference.points(surfaces) + stages.grid.center
    on_floor = (surfaces.triangle >= 0) & (surfaces.normal[..., 2] > 0.9)

    def corner(width, depth, height=1.9):
        a, b = width / height, depth / height
        ra, rb = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
        return (a / ra * np.arctan(b / ra) + b / rb * np.arctan(a / rb)) / (2 * np.pi)

    x, y = points[on_floor][:, 0], points[on_floor][:, 1]
    factor = sum(corner(0.1 + sx * x, 0.05 + sy * y) for sx in (-1, 1) for sy in (-1, 1))
    assert on_floor.sum() > 500
    near = np.abs(points[on_floor][:, :2]).max(axis=1) < 2  # far texels are wide, and their mean is not their centre
    ratio = source[on_floor][near] / (factor[near, None] * RADIANCE)
    assert np.quantile(np.abs(ratio - 1), 0.95) < 0.05 and abs(ratio.mean() - 1) < 5e-3


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


@pytest.mark.parametrize("gather", [1, 2])
@pytest.mark.parametrize("albedo", [0.5, 0.9])
def test_furnace_with_traced_bounces(albedo, gather):
    volume = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (3, 3, 3))
    result = bake(furnace(albedo), volume, BakeSettings(gather=gather))
    assert result.converged
    np.testing.assert_allclose(irradiance_at_nodes(result.field) * (1 - albedo), 1, atol=5e-3)


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
