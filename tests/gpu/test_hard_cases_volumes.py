# SPDX-License-Identifier: GPL-3.0-or-later
"""Hard cases of volumes and probes: of every shape, and where nobody would put them."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.conventions import ACTIVE, INVALID
from gridlight.core.errors import InputError
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import World
from hard_rooms import (
    HALF,
    LAMP,
    SMALL,
    bake_room,
    check_whole,
    difference,
    grid,
    light_at,
    points,
    room,
    walls,
)
from small_scenes import bake, box, frame, furnace, irradiance_at_nodes, snapshot_of

pytestmark = pytest.mark.any_version


def box_matrix(axes, centre=(0.0, 0.0, 0.0)):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, centre
    return matrix


TURN = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
SHAPES = {
    "turned": (box_matrix(0.5 * TURN * np.linalg.det(TURN)), (3, 3, 3)),
    "sheared": (box_matrix([[0.6, 0.3, 0], [0, 0.6, -0.2], [0.2, 0, 0.6]]), (3, 3, 3)),
    "mirrored": (box_matrix(np.diag([-0.8, 0.8, 0.8])), (3, 3, 3)),
    "upside down": (box_matrix(np.diag([0.8, 0.8, -0.8])), (3, 2, 3)),
    "flat": (box_matrix(np.diag([0.8, 0.8, 0.8])), (4, 3, 1)),
    "flat and thin": (box_matrix(np.diag([0.8, 1e-3, 0.8])), (3, 1, 4)),
    "a row": (box_matrix(np.diag([0.8, 0.5, 0.5])), (1, 1, 5)),
    "single": (box_matrix(np.diag([0.8, 0.8, 0.8])), (1, 1, 1)),
    "256 along one axis": (box_matrix(np.diag([0.8, 0.8, 0.8])), (256, 1, 1)),
    "stretched": (box_matrix(np.diag([0.9, 1e-2, 1e-2])), (5, 2, 2)),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_a_furnace_looks_alike_to_volumes_of_every_shape(shape):
    """Radiance 2 everywhere at albedo ½, whatever the volume."""
    matrix, resolution = SHAPES[shape]
    result = bake(furnace(0.5), Grid(matrix, resolution), BakeSettings(face=4, keep_all=True))
    check_whole(result)
    assert result.converged and result.counts["active"] == result.counts["total"]
    np.testing.assert_allclose(irradiance_at_nodes(result.field), 2, atol=2e-2)


@pytest.mark.parametrize("shape", ["mirrored", "upside down"])
def test_a_mirrored_volume_has_the_same_probes_in_another_order(shape):
    matrix, resolution = SHAPES[shape]
    straight = Grid(np.abs(matrix), resolution)
    settings = BakeSettings(face=8, bounces=2)
    fields = [bake(room(), volume, settings).field for volume in (straight, Grid(matrix, resolution))]
    order = [np.lexsort(np.round(field.grid.positions(), 6).T) for field in fields]
    found, expected = (irradiance_at_nodes(field)[rows] for field, rows in zip(fields, order))
    np.testing.assert_array_equal(fields[0].state[order[0]], fields[1].state[order[1]])
    assert difference(found, expected) < 5e-3


@pytest.mark.parametrize("axes", [np.diag([1.0, 1.0, 0.0]), np.ones((3, 3)), np.diag([1.0, np.nan, 1.0])])
def test_boxes_without_volume_are_refused(axes):
    with pytest.raises(InputError, match="zero size|no volume|finite"):
        Grid(box_matrix(axes), (2, 2, 1))


@pytest.mark.parametrize("size, place", [(1e10, 0.0), (1e30, 0.0), (1e-12, 0.0), (1.0, 1e12)])
def test_boxes_that_32_bits_cannot_hold_are_refused(size, place):
    with pytest.raises(InputError, match="scale it to between"):
        Grid(box_matrix(size * np.eye(3), (place, 0, 0)), (2, 2, 2))


# Where probes stand
# --------------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def plain(gpu_context):
    """Light in the middle of the room by a volume well inside it; another lattice may differ by a tenth."""
    return light_at(bake_room(grid((5, 4, 4), 0.25)), points())


def check_room(result, expected, tolerance):
    check_whole(result)
    found = light_at(result, points())
    assert difference(found, expected) < tolerance
    assert (found > -1e-3 * expected.max()).all()


@pytest.mark.parametrize("inset", [0.0, 1e-7, -1e-7, 1e-3, -1e-3, -0.1])
def test_probes_on_surfaces_edges_and_corners(plain, inset):
    """All outer nodes stand on a wall, an edge or a corner, a hair before or behind it, or in the wall."""
    check_room(bake_room(grid((5, 4, 4), inset)), plain, 0.15)


@pytest.mark.parametrize("resolution, inset", [((3, 3, 3), -0.1), ((2, 2, 2), -0.15)])
def test_probes_come_out_of_edges_and_corners(plain, resolution, inset):
    """Two and three walls deep, of volumes that have all but one of their nodes in the walls, and all of them, nearer
    to the void than to the room. (A cube face shows only what is nearest in it, and that may be the way back.)"""
    result = bake_room(grid(resolution, inset))
    active = result.field.state == ACTIVE
    assert active.all()
    stands = result.field.grid.positions() + result.field.offset
    assert (np.abs(stands[active]) < HALF).all()
    check_room(result, plain, 0.3)


def test_probes_inside_a_solid_are_invalid_and_light_nothing():
    """A block half as wide as the room, some nodes deep inside it: the light around it does not know them."""
    block = box((-0.9, -0.9, -1.25), (0.9, 0.9, 0.2))
    volume = Grid.from_bounds((-1.7, -1.3, -1.05), (1.7, 1.3, 1.05), (7, 7, 6))
    result = bake_room(volume, extra=[block])
    check_whole(result)
    nodes = volume.positions()
    deep = (np.abs(nodes[:, :2]) < 0.6).all(axis=1) & (nodes[:, 2] < -0.4)
    assert deep.sum() == 18
    kept = result.field.state[deep & (result.field.state != 0)]
    assert len(kept) and (kept == INVALID).all()
    beside = np.array([[1.4, 0.0, -0.5], [-1.4, 0.3, -0.5], [0.2, -1.2, -0.6]])
    assert (light_at(result, beside) > 0.02).all()


@pytest.mark.parametrize("keep_all", [False, True])
def test_a_volume_outside_all_geometry_sees_the_world(keep_all):
    """Probes ten rooms away: the world, and the room's outside as a small dark spot."""
    volume = Grid.from_bounds((30, 30, 30), (33, 33, 33), (2, 2, 2))
    result = bake(room(world=World((0.5, 1.0, 2.0))), volume, BakeSettings(face=8, keep_all=keep_all))
    check_whole(result)
    np.testing.assert_allclose(
        irradiance_at_nodes(result.field), np.broadcast_to([0.5, 1.0, 2.0], (8, 6, 3)), rtol=1e-2
    )


def test_half_of_a_volume_outside_does_not_darken_the_room(plain):
    volume = Grid.from_bounds((-2 * HALF[0], -1.2, -1.0), (0.8 * HALF[0], 1.2, 1.0), (9, 4, 3))
    result = bake_room(volume)
    inside = np.abs(points()[:, 0]) < 1.4
    assert difference(light_at(result, points()[inside]), plain[inside]) < 0.15


@pytest.mark.parametrize(
    "resolution, inset",
    [((5, 4, 4), 0.15), ((6, 4, 4), 0.15), ((7, 4, 4), -0.1)],
    ids=["a node in the wall", "none near it", "nodes in all outer walls"],
)
def test_light_does_not_pass_a_wall_of_ten_centimetres(resolution, inset):
    """A wall across the room, the lamp in one half: half a percent of its light at most is read in the other, where
    none is. By distances, not inverse ones, 0.6 to 1.5 % leaked, and dark rooms left their walls to bright ones."""
    partition = box((-0.05, -HALF[1], -HALF[2]), (0.05, HALF[1], HALF[2]))
    result = bake_room(
        grid(resolution, inset), extra=[partition], lights=[replace(LAMP, matrix=frame((1.1, 0.4, 0.5)))]
    )
    check_whole(result)
    lit = np.random.default_rng(0).uniform([0.06, -HALF[1], -HALF[2]], HALF, (1000, 3))
    dark = light_at(result, lit * [-1, 1, 1]).mean()
    assert dark < 0.005 * light_at(result, lit).mean()


def test_a_room_thinner_than_a_cell():
    """A corridor 30 cm wide between probes a metre apart: finite, and not black where it is lit."""
    half = np.array([2.0, 0.15, 1.25])
    corridor = room(corners=walls(half), lights=[replace(LAMP, matrix=frame((0.3, 0.05, 0.4)))])
    volume = Grid.from_bounds((-1.8, -1.0, -1.0), (1.8, 1.0, 1.0), (4, 3, 3))
    result = bake(corridor, volume, SMALL)
    check_whole(result)
    assert (light_at(result, np.array([[0.8, 0.0, 0.3], [-0.6, 0.05, 0.1]])).mean(axis=1) > 0.05).all()


def test_culled_probes_are_filled_from_the_others():
    """An open plain: probes high above it are culled and still carry light."""
    ground = box((-40, -40, -2), (40, 40, -1))
    volume = Grid.from_bounds((-2, -2, -0.9), (2, 2, 6), (3, 3, 6))
    result = bake(snapshot_of(ground, world=World((1.0, 1.0, 1.0))), volume, SMALL)
    check_whole(result)
    assert result.counts["culled"] > 9
    culled = result.field.state != ACTIVE
    assert (result.field.coefficients[culled, 0] > 0.5).all()


def test_probes_near_the_outside_of_a_wall_come_into_the_rooms_behind_it():
    """A lit and a dark room; nodes in their common wall, 2 cm from the void, which is the nearer way out."""
    partition = box((-0.1, -1.5, -1.25), (0.0, 1.5, 1.25))
    volume = Grid.from_bounds((-1.2, -0.5, -0.6), (1.2, 1.68, 0.6), (2, 2, 2))
    field = bake_room(volume, extra=[partition]).field
    in_wall = volume.positions()[:, 1] > 1.5
    assert (field.state == ACTIVE).all()
    assert ((volume.positions() + field.offset)[in_wall, 1] < 1.5).all()
    lit = volume.positions()[:, 0] > 0
    assert (field.coefficients[lit, 0] > 0).all() and not field.coefficients[~lit].any()
