# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases of light: of every power, in every place, by the thousand, negative, and of a single pixel."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.errors import InputError
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_directions, panorama_solid_angles, project_panorama
from gridlight.core.patches import MOST_PARTS
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material, World
from hard_rooms import GREY, HALF, LAMP, SMALL, bake_room, check_whole, difference, grid, light_at, points, room
from small_scenes import all_lights, bake, box, frame, irradiance_at_nodes, snapshot_of

pytestmark = pytest.mark.any_version


@pytest.fixture(scope="module")
def plain(gpu_context):
    """Light in the room with its own lamp."""
    return light_at(bake_room(), points())


def mean_of_walls(flux):
    """Mean radiance that a lamp of ``flux`` W makes the walls send: a Φ / π A (1 − a), wherever it hangs."""
    albedo, (x, y, z) = GREY.base_color[0], HALF
    return albedo * flux / (np.pi * 8 * (x * y + y * z + x * z) * (1 - albedo))


def times(light, factor):
    return replace(light, color=tuple(factor * channel for channel in light.color))


@pytest.mark.parametrize("factor", [1e-15, 1e-9, 1e9, 1e15])
def test_light_of_any_power(plain, factor):
    """The same light, scaled, after the same number of bounces that the program chose."""
    result = bake_room(lights=[times(LAMP, factor)])
    check_whole(result)
    assert result.converged
    assert difference(light_at(result, points()) / factor, plain) < 1e-4


def test_a_billion_watts_and_a_billionth_in_one_scene(plain):
    weak = Light("weak", "POINT", (1e-9,) * 3, frame((-1.0, 0.5, -0.3)))
    result = bake_room(lights=[times(LAMP, 1e9), weak])
    check_whole(result)
    assert difference(light_at(result, points()) / 1e9, plain) < 1e-4


@pytest.mark.parametrize("radiance", [np.inf, np.nan, 1e38])
def test_light_that_is_not_finite_is_refused(radiance):
    glowing = Material("glowing", (0.5,) * 3, emission=(radiance,) * 3)
    with pytest.raises(InputError, match="not finite"):
        bake(snapshot_of(box(), materials=[glowing]), Grid.from_bounds([-0.9] * 3, [0.9] * 3, (2, 2, 2)), SMALL)


PLACES = {
    "on the floor": (0.3, 0.2, -HALF[2]),
    "in a corner": tuple(-HALF),
    "on a probe": tuple(grid().positions()[21]),
}


@pytest.mark.parametrize("radius", [0.0, 0.05])
@pytest.mark.parametrize("place", PLACES)
def test_a_lamp_that_touches_something(plain, place, radius):
    """Half or more of its light may end in the wall; never is there more than the free lamp gives."""
    lamp = replace(LAMP, matrix=frame(PLACES[place]), radius=radius)
    result = bake_room(lights=[lamp])
    check_whole(result)
    assert light_at(result, points()).mean() < 1.3 * plain.mean()


@pytest.mark.parametrize("radius", [0.0, 0.05])
def test_a_lamp_inside_a_wall_lights_nothing(radius):
    result = bake_room(lights=[replace(LAMP, matrix=frame((0.0, 0.0, -HALF[2] - 0.1)), radius=radius)])
    check_whole(result)
    assert light_at(result, points()).max() < 1e-6


@pytest.mark.parametrize("distance", [0.3, 0.03, 0.003])
def test_a_lamp_near_a_wall_gives_no_more_light_than_it_has(distance):
    """Near a wall half its light falls on a spot smaller than a texel, which one sample hits or misses."""
    law = mean_of_walls(4 * np.pi)
    random = np.random.default_rng(0)
    for _ in range(3):
        place = random.uniform(-0.7, 0.7, 3) * HALF
        axis = random.integers(3)
        place[axis] = random.choice([-1, 1]) * (HALF[axis] - distance)
        lamp = Light("lamp", "POINT", (1.0,) * 3, frame(place))
        mean = bake_room(grid((3, 3, 2), 0.4), lights=[lamp]).field.coefficients[:, 0].mean() * 0.28209479177387814
        assert mean < 1.5 * law, mean / law


@pytest.mark.parametrize("count", [200, pytest.param(5000, marks=pytest.mark.nightly)])
def test_thousands_of_lamps_are_one(count):
    """Some drivers end a shader's loops after so many rounds: none of the light may be lost to that."""
    volume, settings = grid((2, 1, 1)), BakeSettings(face=4, bounces=0)
    one, many = (bake_room(volume, settings, lights=lamps) for lamps in ([LAMP], [times(LAMP, 1 / count)] * count))
    check_whole(many)
    np.testing.assert_allclose(many.field.coefficients, one.field.coefficients, rtol=2e-3, atol=1e-4)


def test_lamps_that_share_rays_are_the_sum_of_those_that_do_not():
    """Six times MOST_PARTS lamps, in a room with something to cast shadows."""
    generator, block = np.random.default_rng(1), box((-0.2, -0.3, -0.4), (0.2, 0.1, 0.3))
    places = generator.uniform(-0.9, 0.9, (6 * MOST_PARTS, 3)) * HALF
    lamps = [
        Light(f"lamp {number}", "POINT", tuple(generator.uniform(0, 1, 3)), frame(place), radius=0.02)
        for number, place in enumerate(places)
    ]
    together = bake_room(extra=[block], lights=lamps)
    check_whole(together)
    alone = [
        light_at(bake_room(extra=[block], lights=lamps[first : first + MOST_PARTS]), points())
        for first in range(0, len(lamps), MOST_PARTS)
    ]
    expected = np.sum(alone, axis=0)
    error = light_at(together, points()) - expected
    assert np.sqrt((error**2).mean()) < 0.02 * np.sqrt((expected**2).mean())
    assert abs(error.mean()) < 0.005 * expected.mean()


@pytest.mark.parametrize("count,grains", [(20, 8_000), pytest.param(50, 40_000, marks=pytest.mark.nightly)])
def test_lamps_among_many_triangles(count, grains):
    """Many lamps in one place and many triangles: long loops in long loops."""
    random = np.random.default_rng(0)
    dust = random.uniform(-0.95, 0.95, (grains, 1, 3)) * HALF + random.normal(0, 2e-3, (grains, 3, 3))
    volume, settings = grid((2, 1, 1)), BakeSettings(face=4, bounces=0)
    one, many = (
        bake_room(volume, settings, extra=[dust], lights=lamps) for lamps in ([LAMP], [times(LAMP, 1 / count)] * count)
    )
    np.testing.assert_allclose(many.field.coefficients, one.field.coefficients, rtol=2e-3, atol=1e-4)


def test_a_lamp_of_negative_power_takes_away_what_it_would_give(plain):
    """As in Cycles. Two lamps in one place, one of them negative, are their difference."""
    lamps = [times(LAMP, 3.0), replace(times(LAMP, -2.0), name="negative")]
    result = bake_room(lights=lamps)
    check_whole(result)
    assert difference(light_at(result, points()), plain) < 1e-3
    alone = bake_room(lights=[times(LAMP, -1.0)])
    check_whole(alone)
    assert (light_at(alone, points()).mean(axis=1) < 0).all()


def test_negative_emission_and_a_negative_sky():
    dark = Material("dark", (0.5,) * 3, emission=(-1.0,) * 3)
    volume = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (2, 2, 2))
    result = bake(snapshot_of(box(), materials=[dark]), volume, replace(SMALL, bounces=0))
    check_whole(result)
    np.testing.assert_allclose(irradiance_at_nodes(result.field), -1, rtol=1e-4)
    far = box((-1, -1, 5000), (1, 1, 5002))
    result = bake(snapshot_of(far, world=World((-0.5,) * 3)), volume, SMALL)
    np.testing.assert_allclose(irradiance_at_nodes(result.field), -0.5, rtol=1e-4)


@pytest.mark.parametrize("face", [4, 8, 16])
def test_a_sky_with_a_sun_of_one_pixel(face):
    """10⁶ times as bright as the rest, 2·10⁻⁴ sr: its light arrives whole, whichever texel it falls into."""
    sky = np.ones((128, 256, 3), np.float32)
    sky[90, 70] = 1e6
    snapshot = snapshot_of(box((-1, -1, -5002), (1, 1, -5000)), world=World(map=sky))
    volume = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (2, 2, 2))
    result = bake(snapshot, volume, BakeSettings(face=face, keep_all=True, bounces=0))
    check_whole(result)
    expected = project_panorama(sky, 3)[0]
    np.testing.assert_allclose(result.field.coefficients[:, 0], np.broadcast_to(expected, (8, 3)), rtol=5e-3)


def odd_lights():
    """Lights at the ends of their ranges."""
    at = frame((0.31, 0.47, 0.7), (0.2, 0.1, -1.0))
    color = (1.0, 1.0, 1.0)
    return {
        "spot of 180°": Light("l", "SPOT", color, at, spot_size=np.pi, spot_blend=1.0),
        "spot of 1° without blend": Light("l", "SPOT", color, at, spot_size=0.0175, spot_blend=0.0),
        "spot scaled flat": Light("l", "SPOT", color, at, spot_size=1.0, spot_scale=(1.0, 1e-6, 1.0)),
        "sun as wide as the sky": Light("l", "SUN", color, at, angle=np.pi),
        "area of no size": Light("l", "AREA", color, at, size_x=0.0, size_y=0.0),
        "area of no width": Light("l", "AREA", (1e3,) * 3, at, size_x=0.5, size_y=1e-6),
        "area of no spread": Light("l", "AREA", color, at, size_x=0.2, size_y=0.2, spread=1e-4),
        "lamp larger than the room": Light("l", "POINT", color, at, radius=10.0),
        "sphere larger than the room": Light("l", "POINT", color, at, radius=10.0, soft_falloff=False),
        "lamp of a millionth": Light("l", "POINT", color, at, radius=1e-7),
        "without colour": Light("l", "POINT", (0.0, 0.0, 0.0), at),
    }


@pytest.mark.parametrize("covered", [0.0, 0.5, 1.0])
def test_a_sun_of_the_sky_behind_an_edge(covered):
    """Texels of 8² faces are eleven degrees wide, the sun is one: probes must see the part of it that a black wall
    leaves, from where it stands, whatever texel it falls into."""
    height = 256
    sky = np.zeros((height, 2 * height, 3), np.float32)
    row, columns = 160, (300, 301)
    sky[row, columns] = 1e4
    direction = panorama_directions(2 * height, height)[row, columns].mean(axis=0)
    direction /= np.linalg.norm(direction)
    flux = 1e4 * panorama_solid_angles(2 * height, height)[row, columns].sum()
    level = np.cross([0, 0, 1], direction)
    level /= np.linalg.norm(level)
    up = np.cross(direction, level)
    # a wall whose upper edge is seen at the sun's middle, or above or below it
    edge = (covered - 0.5) * 0.2 * up + direction
    wall = 10 * np.array([edge - level, edge + level, edge + level - up, edge - level - up])
    probes = Grid.from_bounds((-1e-3,) * 3, (1e-3,) * 3, (2, 2, 2))
    snapshot = snapshot_of(wall[[[0, 1, 2], [0, 2, 3]]], materials=[Material("black", (0,) * 3)], world=World(map=sky))
    result = bake(snapshot, probes, BakeSettings(face=8, keep_all=True))
    check_whole(result)
    coefficients = result.field.coefficients[:, :, 0].astype(float)
    seen = 1 - covered
    np.testing.assert_allclose(coefficients[:, 0] / 0.28209479177387814, flux * seen, rtol=0.1, atol=1e-3 * flux)
    towards = coefficients[:, [3, 1, 2]].mean(axis=0) / 0.4886025119029199
    np.testing.assert_allclose(towards, flux * seen * direction, atol=0.02 * flux)


@pytest.mark.parametrize("name", odd_lights())
def test_lamps_at_the_ends_of_their_ranges(name):
    result = bake_room(grid((2, 2, 2)), lights=[odd_lights()[name]])
    check_whole(result)
    assert result.converged
    assert light_at(result, points()).min() > -0.05 * max(light_at(result, points()).max(), 1e-6)


@pytest.mark.parametrize("kind", all_lights())
def test_a_lamp_exactly_on_a_surface_it_faces(kind):
    """No distance, no direction: finite."""
    light = all_lights()[kind]
    matrix = light.matrix.copy()
    matrix[:3, 3] = 0.0, 0.0, -HALF[2]
    check_whole(bake_room(grid((2, 2, 2)), lights=[replace(light, matrix=matrix)]))


def test_emitters_of_no_area_and_of_a_millimetre():
    """A glowing needle has nothing to send. A glowing grain of edge s sends L s² (|x| + |y| + |z|) along (x, y, z), and
    the room's walls on top what any lamp of its flux 6 π L s² makes them send."""
    radiance, edge, place = 1000.0, 1e-3, np.array([0.3, 0.2, 0.1])
    glowing = Material("glowing", (0.0,) * 3, emission=(radiance,) * 3)
    grain = box((-edge / 2,) * 3, (edge / 2,) * 3) + place
    snapshot = room(extra=[grain], lights=[], materials=[GREY, glowing])
    snapshot.material_index[72:] = 1
    result = bake(snapshot, grid(), SMALL)
    check_whole(result)
    walls_send = mean_of_walls(6 * np.pi * radiance * edge**2)
    offset = grid().positions() - place
    distance = np.linalg.norm(offset, axis=1)
    spread = np.abs(offset).sum(axis=1) / distance
    direct = radiance * edge**2 * spread / distance**2 * spread / 6 / np.pi  # mean over six normals, over π
    assert irradiance_at_nodes(result.field).mean() == pytest.approx(walls_send + direct.mean(), rel=0.15)
    snapshot.vertices[72 * 3 : 73 * 3] = [[0, 0, 0], [1, 0, 0], [0.5, 0, 0]]
    check_whole(bake(snapshot, grid(), SMALL))
