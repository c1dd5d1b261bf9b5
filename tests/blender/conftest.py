# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets the tests here import the scene builders beside them, and builds the scenes that most commands and operators are
tried on. Files with scenes of their own kind have fixtures of the same names."""

import sys
from pathlib import Path

import bpy
import gridlight
import numpy as np
import pytest
from gridlight.scene.volumes import create_volume

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def lit_room(tmp_path_factory):
    """A .blend with a closed room and a lamp, read only."""
    from bake_command import lamp, room, save

    return save(tmp_path_factory.mktemp("scenes") / "room.blend", room, lamp)


@pytest.fixture
def scene():
    """An empty scene, with the extension registered."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    gridlight.register()
    yield bpy.context.scene
    gridlight.unregister()


@pytest.fixture
def room(scene):
    """A closed room with a lamp, and a volume of 3×3×3 in it."""
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.3, 1.0))
    bpy.context.object.data.energy = 100.0
    volume = create_volume(scene, "Room", np.diag([1.6, 1.6, 1.6, 1.0]), (3, 3, 3))
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = volume
    return volume
