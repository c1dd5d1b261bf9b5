# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets the tests here import the scene builders beside them, and builds the scene that most commands are tried on."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def lit_room(tmp_path_factory):
    """A .blend with a closed room and a lamp, read only."""
    from bake_command import lamp, room, save

    return save(tmp_path_factory.mktemp("scenes") / "room.blend", room, lamp)
