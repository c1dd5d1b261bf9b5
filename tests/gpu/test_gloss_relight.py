# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit bakes of rooms with glossy surfaces are fresh bakes of the changed scene."""

from dataclasses import replace

import pytest
from gridlight.core.gloss import Gloss
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import World
from gridlight.tests.changed_snapshots import with_light, with_material, with_moved
from small_scenes import bake
from test_relight import SETTINGS, assert_same_bake, followed, grid, rooms, session_of

pytestmark = pytest.mark.any_version

WHITE = (1.0, 1.0, 1.0)
METAL, COAT = Gloss(WHITE, (0.8, 0.8, 0.8), 0.2), Gloss((0.1, 0.1, 0.1), (0.04, 0.04, 0.04), 0.1)
SMALL = (3, 2, 2)


def glossy_rooms():
    return with_material(with_material(rooms(), 0, gloss=COAT), 1, gloss=METAL)


CHANGES = {
    "a lamp moved": lambda room: with_light(room, 0, matrix=room.lights[2].matrix * 0.5 + room.lights[0].matrix * 0.5),
    "a lamp's colour": lambda room: with_light(room, 1, color=(1.0, 8.0, 2.0)),
    "the world": lambda room: replace(room, world=World((0.9, 0.2, 0.1))),
    "emission": lambda room: with_material(room, 3, emission=(2.0, 30.0, 8.0)),
    "roughness": lambda room: with_material(room, 1, gloss=replace(METAL, roughness=0.5)),
    "no gloss": lambda room: with_material(with_material(room, 0, gloss=None), 1, gloss=None),
    "something moved": lambda room: with_moved(room, 2, (0.0, 0.3, 0.0)),
}


MOVES_PLACES = ("roughness", "no gloss", "something moved")  # rays end elsewhere, so patches are found anew


@pytest.mark.parametrize(
    "names",
    [
        ("a lamp moved", "the world", "roughness"),
        pytest.param(("a lamp's colour", "emission", "something moved", "no gloss"), marks=pytest.mark.nightly),
    ],
)
def test_relights_with_gloss_are_fresh_bakes(names):
    """One change on top of the other, so errors would add up."""
    room = glossy_rooms()
    where = grid((2, 1, 1))
    session = session_of(room, where, face=6)
    for name in names:
        room = CHANGES[name](room)
        followed(session.relight(room))
        assert_same_bake(session.result, bake(room, where, BakeSettings(**{**SETTINGS, "face": 6})))
        assert session.result.relit.kept_places == (name not in MOVES_PLACES), name


@pytest.mark.nightly
def test_a_bake_that_becomes_glossy():
    session = session_of(rooms(), grid(SMALL))
    followed(session.relight(glossy_rooms()))
    assert_same_bake(session.result, bake(glossy_rooms(), grid(SMALL), BakeSettings(**SETTINGS)))


@pytest.mark.nightly
def test_texels_that_do_not_stay_give_the_same():
    """What is captured again mirrors the same."""
    room = glossy_rooms()
    settings = {**SETTINGS, "face": 32}
    found, expected = (
        bake(room, grid((5, 3, 2)), BakeSettings(**settings, memory_mib=memory)).field.coefficients
        for memory in (16, 512)
    )
    assert (found == expected).all()
