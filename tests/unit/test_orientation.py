# SPDX-License-Identifier: GPL-3.0-or-later
"""The vote on objects whose normals point the wrong way."""

import numpy as np
from gridlight.core.orientation import ShellVote, flipped_objects, inside_solid


def test_an_object_seen_from_behind_by_most_probes_is_flipped():
    # object 0: two probes see it from behind, one from the front; object 1: from the front; object 2: nobody sees it
    sightings = np.array([[-1, -1, 2, 0], [-1, 1, -1, 2], [1, 1, 0, 2]])
    np.testing.assert_array_equal(flipped_objects(sightings, 3), [True, False, False])


def test_probes_count_once_however_much_they_see():
    """A probe stuck inside a solid sees nothing but its back; many directions of one probe are still one vote."""
    sightings = np.concatenate([np.full((1, 100), -1), np.tile([1] + [0] * 99, (2, 1))])
    assert not flipped_objects(sightings, 1)[0]


def test_a_draw_keeps_the_normals():
    assert not flipped_objects(np.array([[-1], [1]]), 1)[0]


def test_nothing_in_sight():
    assert not flipped_objects(np.zeros((4, 8)), 3).any()


def test_many_objects_and_probes():
    generator = np.random.default_rng(0)
    inside_out = generator.random(50) < 0.3
    which = generator.integers(0, 50, (200, 64))
    sightings = np.where(inside_out[which], -1, 1) * (which + 1)
    np.testing.assert_array_equal(flipped_objects(sightings, 50), inside_out)


def shells(sightings, count):
    vote = ShellVote(count)
    for part in np.array_split(np.asarray(sightings, float), 2):
        vote.add(part)
    return vote.shells()


def test_lit_back_faces_are_shells_and_dark_ones_solids():
    # object 0: seen from behind and lit; object 1: from behind in the dark; object 2: from the front
    np.testing.assert_array_equal(shells([[-1.5] * 4, [-2.0] * 4, [3.5] * 4], 3), [True, False, False])


def test_back_faces_beside_a_view_outside_are_shells():
    np.testing.assert_array_equal(shells([[-1.0, -1, 0, 0], [-2.0, -2, -2, -2]], 2), [True, False])


def test_a_light_leak_makes_no_shell():
    assert not shells([[-1.5] + [-1.0] * 99, [-1.0] * 100], 1)[0]


def test_in_the_dark_rooms_are_not_taken_for_solids():
    assert shells([[-1.0] * 8, [2.0] * 8], 2).all()


def test_inside_a_solid():
    """Shares of back faces of solids, background, lit, all back faces."""
    shares = np.array([[0.6, 0, 0, 0.6], [0.4, 0, 0.5, 0.4], [0.0, 0, 0, 0.9], [0.0, 0.2, 0, 0.8], [0.0, 0, 0.1, 0.9]])
    np.testing.assert_array_equal(inside_solid(shares), [True, False, True, False, False])


def test_a_scene_without_light_has_no_insides():
    assert not inside_solid(np.tile([0.0, 0, 0, 1.0], (3, 1))).any()
