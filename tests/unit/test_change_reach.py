# SPDX-License-Identifier: GPL-3.0-or-later
"""What a change of shape can reach, against capturing and tracing everything again: nothing may be missed, and the test
must be worth having."""

import numpy as np
import pytest
from gridlight.core import rays
from gridlight.core.change_reach import RASTER_SPREAD, grown, probes_that_see
from gridlight.core.cubemap import texel_directions
from gridlight.core.scene_changes import boxes_around

FACE = 8
DIRECTIONS = texel_directions(FACE).reshape(-1, 3)


def random_scene(generator, still=30, moving=8):
    """Triangles (T, 3, 3) before and after one object of ``moving`` triangles moved, turned and perhaps grew; and which
    are its."""
    corners = generator.uniform(-1, 1, (still + moving, 1, 3)) + generator.normal(0, 0.25, (still + moving, 3, 3))
    mine = np.arange(still + moving) >= still
    size = generator.choice([0.05, 0.3, 1.0])
    corners[mine] = corners[mine] * size + generator.uniform(-1, 1, 3)
    after = corners.copy()
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    middle = corners[mine].reshape(-1, 3).mean(axis=0)
    step = generator.normal(0, generator.choice([1e-3, 0.3, 1.0]), 3)
    after[mine] = (corners[mine] - middle) @ turn * generator.uniform(0.5, 2) + middle + step
    return corners, after, mine


def capture(triangles, positions):
    """Distance and triangle (P, X) of every texel."""
    count = len(DIRECTIONS)
    hits = rays.closest_hit(triangles, np.repeat(positions, count, axis=0), np.tile(DIRECTIONS, (len(positions), 1)))
    return hits.distance.reshape(-1, count), hits.triangle.reshape(-1, count)


def reach(before, after, mine, positions, distances, spread=0.0):
    old, new = (grown(boxes_around(t[mine]), positions, spread) for t in (before, after))
    return probes_that_see(positions, DIRECTIONS, distances, old, new)


@pytest.mark.parametrize("seed", range(40))
def test_no_probe_that_sees_a_change_is_missed(seed):
    generator = np.random.default_rng(seed)
    before, after, mine = random_scene(generator)
    positions = generator.uniform(-1, 1, (12, 3))
    old_distance, old_triangle = capture(before, positions)
    new_distance, new_triangle = capture(after, positions)
    sees = mine[old_triangle] & (old_triangle >= 0) | mine[new_triangle] & (new_triangle >= 0)
    changed = (sees | (old_distance != new_distance)).any(axis=1)
    assert (reach(before, after, mine, positions, old_distance) >= changed).all()


@pytest.mark.parametrize("seed", range(10))
def test_what_comes_or_leaves_is_seen(seed):
    generator = np.random.default_rng(100 + seed)
    everything, _, mine = random_scene(generator)
    rest = everything[~mine]
    positions = generator.uniform(-1, 1, (12, 3))
    with_it, without = capture(everything, positions)[0], capture(rest, positions)[0]
    changed = (with_it != without).any(axis=1)
    boxes, none = grown(boxes_around(everything[mine]), positions), np.empty((0, 2, 3))
    assert (probes_that_see(positions, DIRECTIONS, without, none, boxes) >= changed).all()
    assert (probes_that_see(positions, DIRECTIONS, with_it, boxes, none) >= changed).all()


def test_the_test_is_worth_having():
    """In a hall divided by walls, a chair that moves is seen from its own room only."""
    generator = np.random.default_rng(5)
    walls = []
    for x in (0.0, 1.0, 2.0, 3.0, 4.0):
        square = np.array([[x, 0, 0], [x, 1, 0], [x, 1, 1], [x, 0, 1]])
        walls += [square[[0, 1, 2]], square[[0, 2, 3]]]
    chair = np.array([2.4, 0.5, 0.2]) + generator.normal(0, 0.05, (20, 3, 3))
    before = np.concatenate([walls, chair])
    after = np.concatenate([walls, chair + [0.2, 0.1, 0.0]])
    mine = np.arange(len(before)) >= len(walls)
    positions = np.stack(np.meshgrid(np.arange(0.25, 4, 0.5), [0.3, 0.7], [0.5], indexing="ij"), -1).reshape(-1, 3)
    distances, _ = capture(before, positions)
    seen = reach(before, after, mine, positions, distances)
    in_room = (positions[:, 0] > 2) & (positions[:, 0] < 3)
    np.testing.assert_array_equal(seen, in_room)


def test_a_box_behind_what_is_seen_does_not_count():
    wall = np.array([[[-9.0, 1, -9], [9, 1, -9], [0, 1, 20]]])
    positions = np.zeros((1, 3))
    distances, _ = capture(wall, positions)
    behind, before = (np.array([[[-0.1, y, -0.1], [0.1, y + 0.2, 0.1]]]) for y in (2.0, 0.5))
    none = np.empty((0, 2, 3))
    assert not probes_that_see(positions, DIRECTIONS, distances, none, behind)[0]
    assert probes_that_see(positions, DIRECTIONS, distances, none, before)[0]
    assert not probes_that_see(positions, DIRECTIONS, distances, before, none)[0]  # nothing was hit there
    assert probes_that_see(positions, DIRECTIONS, np.where(DIRECTIONS[:, 1] > 0.9, 0.6, 9.0)[None], before, none)[0]


def test_probes_inside_a_box_see_it():
    box = np.array([[[-1.0, -1, -1], [1, 1, 1]]])
    positions = np.array([[0.2, 0.3, 0.4]])
    far = np.full((1, len(DIRECTIONS)), np.inf)
    assert probes_that_see(positions, DIRECTIONS, far, np.empty((0, 2, 3)), box)[0]


def test_rays_along_the_axes():
    """Directions with zeros, beside and through a box."""
    box = np.array([[[1.0, -1, -1], [2, 1, 1]]])
    axes, none = np.eye(3), np.empty((0, 2, 3))
    for place, seen in (((0, 0, 0), True), ((0, 1.5, 0), False), ((1.5, -3, 0.5), True), ((3, 0, 0), False)):
        far = np.full((1, 3), np.inf)
        assert probes_that_see(np.array([place], float), axes, far, none, box)[0] == seen


def test_rasterised_hits_are_given_their_room():
    """A corner that passes a texel's centre by less than a raster step."""
    angle = 0.9 * RASTER_SPREAD / FACE
    direction = DIRECTIONS[np.argmax(DIRECTIONS[:, 0])]
    across = np.cross(direction, [0.0, 0, 1])
    beside = 5 * (direction + across / np.linalg.norm(across) * angle)
    box = np.stack([np.minimum(beside, beside + across), np.maximum(beside, beside + across)])[None]
    positions, far = np.zeros((1, 3)), np.full((1, 1), np.inf)
    none = np.empty((0, 2, 3))
    assert not probes_that_see(positions, direction[None], far, none, grown(box, positions))[0]
    assert probes_that_see(positions, direction[None], far, none, grown(box, positions, RASTER_SPREAD / FACE))[0]
