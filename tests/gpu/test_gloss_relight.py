# SPDX-License-Identifier: GPL-3.0-or-later
"""Relit bakes of rooms with glossy surfaces are fresh bakes of the changed scene."""

from dataclasses import replace

import pytest
from gridlight.core.gloss import Gloss
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import World
from small_scenes import bake
from test_relight import (
    SETTINGS,
    assert_same_bake,
    followed,
    grid,
    rooms,
    session_of,
    with_light,
    with_material,
    with_moved,
)

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


QUICK = ("a lamp moved", "the world", "roughness")


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.nightly) for name in CHANGES]
)
def test_a_relight_with_gloss_is_a_fresh_bake(name):
    room = glossy_rooms()
    changed = CHANGES[name](room)
    session = session_of(room, grid(SMALL))
    followed(session.relight(changed))
    fresh = bake(changed, grid(SMALL), BakeSettings(**SETTINGS))
    assert_same_bake(session.result, fresh)
    assert session.result.relit.kept_places == (name not in ("roughness", "no gloss", "something moved"))


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
