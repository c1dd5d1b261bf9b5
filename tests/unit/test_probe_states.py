# SPDX-License-Identifier: GPL-3.0-or-later
"""What is said about probes: the same reasons in counts and in words."""

import pytest
from gridlight.core.conventions import CULLED, INVALID
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.core.probe_states import describe, invalid_counts, invalid_in_words

pytestmark = pytest.mark.any_version


@pytest.fixture
def field():
    """Six probes in a row, 1 m apart: active, moved, culled, in a solid, behind a wall, and one that nobody baked."""
    field = Field.empty(Grid.from_bounds((0, 0, 0), (5, 1, 1), (6, 1, 1)), 2)
    field.depth[:] = 1.0
    field.offset[1] = 0.0, 0.3, 0.4
    field.state[2:] = CULLED, INVALID, INVALID, INVALID
    field.depth[2] = field.depth[5] = 0.0
    field.validity[3:] = 0.4, 0.5, 1.0
    return field


def test_each_probe_in_words(field):
    assert [describe(field, node) for node in range(6)] == [
        "active, at its node",
        "active, moved 0.5 m from its node",
        "culled: lights nothing, or switched off",
        "invalid: in a solid",
        "invalid: in the dark behind walls",
        "invalid: not baked (a shard is missing)",
    ]


def test_counts_have_each_invalid_probe_once(field):
    counts = invalid_counts([field, field])
    assert counts == {"in_solid": 2, "behind_walls": 2, "not_baked": 2}
    assert invalid_in_words(counts) == "2 in a solid, 2 in the dark behind walls, 2 not baked (a shard is missing)"
    field.state[[3, 5]] = CULLED
    assert invalid_counts([field]) == {"behind_walls": 1}
    assert invalid_in_words({"behind_walls": 1}) == "in the dark behind walls"
    field.state[:] = CULLED
    assert invalid_counts([field]) == {} and invalid_in_words({}) == "in a solid or in the dark behind walls"
