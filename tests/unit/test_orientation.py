# SPDX-License-Identifier: GPL-3.0-or-later
"""The vote on objects whose normals point the wrong way."""

import numpy as np
from gridlight.core.orientation import flipped_objects


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
