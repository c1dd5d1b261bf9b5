# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases of geometry: faces that coincide, cross, have no area, look the wrong way or are missing."""

import numpy as np
import pytest
from gridlight.core.errors import InputError
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Material, World
from hard_rooms import GREY, HALF, LAMP, SMALL, bake_room, check_whole, difference, grid, light_at, points, room, walls
from small_scenes import bake, box, snapshot_of

pytestmark = pytest.mark.any_version


@pytest.fixture(scope="module")
def plain(gpu_context):
    """Light in the plain room."""
    return light_at(bake_room(), points())


def check(plain, tolerance=4e-3, **options):
    # A texel on an edge that rounds elsewhere may lead another patch: then its points, and their noise, are others.
    result = bake_room(**options)
    check_whole(result)
    assert result.counts["active"] == result.counts["total"]
    assert difference(light_at(result, points()), plain) < tolerance


@pytest.mark.parametrize("capture", ["trace", "raster"])
@pytest.mark.parametrize("flipped", [False, True], ids=["alike", "back to back"])
def test_every_face_twice(plain, flipped, capture):
    """Coplanar duplicates of one material are one surface, whichever of the two is hit."""
    twin = walls()[:, ::-1] if flipped else walls()
    check(plain, corners=np.concatenate([walls(), twin]), settings=BakeSettings(face=8, capture=capture))


def test_every_face_three_times_turned(plain):
    """The same quads split along the other diagonal cross their twins everywhere."""
    shifted = np.roll(walls(), 1, axis=1)
    check(plain, corners=np.concatenate([walls(), shifted, walls()[:, [2, 0, 1]]]))


def test_slabs_that_run_into_each_other(plain):
    """Walls as modellers build them: boxes that overlap in all corners."""
    t = 0.2
    slabs = []
    for axis in range(3):
        for side in (-1, 1):
            low, high = -HALF - t, HALF + t
            if side < 0:
                high = np.where(np.arange(3) == axis, -HALF, high)
            else:
                low = np.where(np.arange(3) == axis, HALF, low)
            slabs.append(box(low, high))
    check(plain, 2e-2, corners=np.concatenate(slabs))


@pytest.mark.parametrize("share", [1.0, 0.5], ids=["all", "half of them"])
def test_flipped_normals(plain, share):
    """The reader's arrays for a mesh whose faces look the wrong way."""
    corners = walls()
    flipped = np.random.default_rng(3).random(len(corners)) < share
    corners[flipped] = corners[flipped][:, ::-1]
    check(plain, corners=corners)


def test_shading_normals_that_lie(plain):
    """Corner normals that have nothing to do with the faces: finite, and within the room's energy."""
    snapshot = room()
    random = np.random.default_rng(5).normal(size=snapshot.corner_normals.shape).astype(np.float32)
    snapshot.corner_normals[:] = random / np.linalg.norm(random, axis=2, keepdims=True)
    result = bake(snapshot, grid(), SMALL)
    check_whole(result)
    assert light_at(result, points()).mean() < 2 * plain.mean()


def slivers(width):
    """Needles across the room, ``width`` metres at their thick end."""
    return np.array([[[-2, -1.5, z], [2, 1.5, z], [2, 1.5, z + width]] for z in np.linspace(-1, 1, 50)])


@pytest.mark.parametrize("width", [1e-4, 1e-6, 0.0])
def test_slivers_and_triangles_without_area(plain, width):
    snapshot = room(extra=[slivers(width or 1.0)])
    if width == 0:  # the reader gives such triangles some unit normal
        snapshot.vertices[-150:] = slivers(0.0).reshape(-1, 3)
    result = bake(snapshot, grid(), SMALL)
    check_whole(result)
    assert difference(light_at(result, points()), plain) < 5e-3


def test_triangles_that_are_points(plain):
    snapshot = room(extra=[slivers(1.0)])
    snapshot.vertices[-150:] = 0.1, 0.2, 0.3
    result = bake(snapshot, grid(), SMALL)
    check_whole(result)
    assert difference(light_at(result, points()), plain) < 1e-3


def test_walls_of_single_planes(plain):
    """The face of each slab that looks into the room, both ways round."""
    inner = walls()[(np.abs(walls().mean(axis=1)) <= HALF + 1e-9).all(axis=1)]
    assert len(inner) == 12
    check(plain, 2e-2, corners=inner)
    check(plain, 2e-2, corners=inner[:, ::-1])


def test_an_open_room_under_the_sky():
    """No ceiling and a white sky: brighter up than down, nowhere brighter than the sky and the lamp's light."""
    open_room = np.delete(walls(), np.arange(12, 24), axis=0)
    result = bake(room(corners=open_room, lights=[], world=World((1.0, 1.0, 1.0))), grid(), SMALL)
    check_whole(result)
    found = light_at(result, points()) / np.pi
    assert (found[:, 2] > found[:, 5]).all()
    assert found.max() < 1.02 and found.min() > 0


def test_a_single_triangle():
    result = bake(
        snapshot_of([[[-1, -1, 0], [1, -1, 0], [0, 1, 0]]], materials=[GREY], lights=[LAMP]),
        Grid.from_bounds([-1] * 3, [1] * 3, (3, 3, 3)),
        SMALL,
    )
    check_whole(result)
    assert result.counts["active"] > 0


def test_a_hundred_thousand_tiny_objects(plain):
    """Dust, every grain an object: it changes nothing that can be seen."""
    random = np.random.default_rng(2)
    count = 100_000
    dust = random.uniform(-1, 1, (count, 1, 3)) * (HALF - 0.05) + random.normal(0, 1e-4, (count, 3, 3))
    corners = np.concatenate([walls(), dust])
    objects = np.concatenate([np.arange(72) // 12, 6 + np.arange(count)])
    result = bake(snapshot_of(corners, None, [GREY], objects, lights=[LAMP]), grid(), SMALL)
    check_whole(result)
    assert difference(light_at(result, points()), plain) < 1e-2


@pytest.mark.parametrize("capture", ["trace", "raster"])
def test_a_room_under_a_dome_two_thousand_kilometres_wide(plain, capture):
    """Nothing of it is seen in a closed room. Rasterised, near surfaces were clipped by where the far ones were."""
    check(plain, extra=[box((-1e6,) * 3, (1e6,) * 3)], settings=BakeSettings(face=8, capture=capture))


def test_what_32_bits_cannot_hold_is_refused():
    with pytest.raises(InputError, match="object 'object 6' reaches farther than 1e.09 m"):
        bake_room(extra=[box((-1e12,) * 3, (1e12,) * 3)])


def test_a_scene_without_materials(plain):
    """Blender's grey of 0.8 reflects more than the room's 0.7."""
    result = bake_room(materials=[])
    check_whole(result)
    assert plain.mean() < light_at(result, points()).mean() < 3 * plain.mean()


@pytest.mark.parametrize("albedo", [1.0, 1.5])
def test_surfaces_that_reflect_all_light_or_more(albedo):
    """A furnace that loses nothing goes on growing by one emission a bounce; one that gains light is no scene. Neither
    settles, both end."""
    shining = Material("shining", (albedo,) * 3, emission=(1.0,) * 3)
    result = bake(snapshot_of(box(), materials=[shining]), Grid.from_bounds([-0.9] * 3, [0.9] * 3, (2, 2, 2)), SMALL)
    check_whole(result)
    assert not result.converged
    if albedo == 1.0:
        assert result.field.coefficients[:, 0].max() * 0.2821 < 1.01 * result.iterations
