# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of other files: Blender would not save what is baked or changed there, so nothing is, and that is said."""

import bpy
import gridlight
import numpy as np
import pytest
from gridlight.operators.libraries import library_of
from gridlight.operators.volume_choice import volumes_of
from gridlight.scene.field_storage import load_field, stored_metadata
from gridlight.scene.volumes import create_volume


@pytest.fixture
def library(gpu_context, tmp_path):
    """A file with a collection "Set": a lit cube and a volume of 2×2×2 in it, baked."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    gridlight.register()
    scene = bpy.context.scene
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.3, 1.0))
    create_volume(scene, "Room", np.diag([1.0, 1.0, 1.0, 1.0]), (2, 2, 2))
    home = bpy.data.collections.new("Set")
    scene.collection.children.link(home)
    for item in list(scene.objects):
        item.users_collection[0].objects.unlink(item)
        home.objects.link(item)
    scene.gridlight.face = 8
    bpy.context.view_layer.update()
    bpy.ops.gridlight.bake(everything=True)
    path = tmp_path / "set.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    yield path
    gridlight.unregister()


def use(library, kind: str) -> bpy.types.Object:
    """The library's volume in a new file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(library), link=True) as (_, wanted):
        wanted.collections = ["Set"]
    scene, home = bpy.context.scene, bpy.data.collections["Set"]
    if kind == "override":
        home.override_hierarchy_create(scene, bpy.context.view_layer)
    else:
        scene.collection.children.link(home)
    scene.gridlight.face = 8
    bpy.context.view_layer.update()
    (volume,) = volumes_of(scene)
    bpy.context.view_layer.objects.active = volume
    return volume


@pytest.mark.parametrize("kind", ["link", "override"])
def test_nothing_is_done_that_would_be_lost(library, kind):
    volume = use(library, kind)
    assert library_of(volume) == "set.blend" and stored_metadata(volume)
    for operator in ("bake", "relight", "clear_bake", "fit_volume", "place_probes"):
        with pytest.raises(RuntimeError, match=r"'Room' comes from set\.blend.*in that file"):
            getattr(bpy.ops.gridlight, operator)()


@pytest.mark.parametrize("kind", ["link", "override"])
def test_a_volume_of_ones_own_beside_it_is_baked_and_saved(library, tmp_path, kind):
    elsewhere = load_field(use(library, kind)).coefficients
    scene = bpy.context.scene
    own = create_volume(scene, "Own", np.diag([1.0, 1.0, 1.0, 1.0]), (2, 2, 2))
    bpy.context.view_layer.update()
    bpy.ops.gridlight.bake(everything=True)
    assert stored_metadata(own)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    own, room = volumes_of(bpy.context.scene)
    assert np.array_equal(load_field(room).coefficients, elsewhere) and not library_of(own)
    assert load_field(own).coefficients.any()
