# SPDX-License-Identifier: GPL-3.0-or-later
"""Which back faces are the inside of solids, and which probes stand in there."""

import numpy as np
from gridlight.core.orientation import ShellVote, inside_solid


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
    shares = np.array([[0.6, 0, 0, 0.6], [0.4, 0, 0.5, 0.4], [0.0, 0, 0, 0.9], [0.0, 0.2, 0, 0.7], [0.0, 0, 0.1, 0.9]])
    np.testing.assert_array_equal(inside_solid(shares), [True, False, True, False, False])


def test_in_the_void_behind_walls():
    """Under a black world nothing but back faces and background is in sight; a front or light make it a place."""
    shares = np.array([[0.0, 0.8, 0, 0.2], [0.0, 0.7, 0, 0.2], [0.0, 0.8, 0.5, 0.2], [0.0, 1.0, 0, 0.0]])
    np.testing.assert_array_equal(inside_solid(shares), [True, False, False, False])
    assert not inside_solid(shares[:2]).any(), "nothing is lit at all"


def test_a_scene_without_light_has_no_insides():
    assert not inside_solid(np.tile([0.0, 0, 0, 1.0], (3, 1))).any()
