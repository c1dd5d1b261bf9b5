# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo takes back whatever Gridlight changes in a file, step by step, and redo brings it again."""

import hashlib
from pathlib import Path

import bpy
import numpy as np
from harness import in_blender


def state():
    """What is in the file, as far as Gridlight can change it, in a form that can be compared."""
    objects = {}
    for item in bpy.data.objects:
        light = item.gridlight_light
        own = {key: plain(item[key]) for key in item.keys() if key.startswith("gridlight")}
        objects[item.name] = (
            np.round(np.array(item.matrix_basis), 5).tolist(),
            tuple(item.gridlight_grid.resolution),
            (light.role, light.group, round(light.intensity, 4)),
            own,
            sorted(collection.name for collection in item.users_collection),
        )
    texts = {text.name: {key: plain(text[key]) for key in text.keys()} for text in bpy.data.texts}
    colors = {
        material.name: tuple(material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value)
        for material in bpy.data.materials
        if material.node_tree and "Principled BSDF" in material.node_tree.nodes
    }
    scenes = {scene.name: (len(scene.objects), scene.gridlight.face) for scene in bpy.data.scenes}
    return {"objects": objects, "texts": texts, "colors": colors, "scenes": scenes}


def plain(value):
    """A custom property: names of datablocks, digests of what is long."""
    if isinstance(value, bpy.types.ID):
        return value.name
    data = value if isinstance(value, bytes) else repr(getattr(value, "to_list", lambda: value)()).encode()
    return hashlib.sha256(data).hexdigest()


@in_blender(backends=("opengl",), timeout=180.0)
def test_every_change_is_taken_back_and_comes_again(person):
    cube = bpy.data.objects["Cube"]
    cube.scale = (3, 3, 3)
    bpy.data.objects["Light"].location = (0.5, 0.4, 1.5)
    bpy.data.objects["Light"].gridlight_light.group = "CEILING_1"
    bpy.context.scene.gridlight.face = 4
    person.window.view_layer.update()
    folder = Path(bpy.app.tempdir) / "undo"

    def operator(name, **options):
        def act():
            assert person.do(f"gridlight.{name}", **options) == {"FINISHED"}
            yield 0.05

        act.__name__ = name
        return act

    def few_probes():
        bpy.data.objects["Gridlight Volume"].gridlight_grid.resolution = (3, 3, 3)
        yield from pushed("few probes")

    def grow_the_room():
        bpy.data.objects["Cube"].scale = (4, 3, 3)
        yield from pushed("grow")

    def move_a_probe():
        probe = next(item for item in bpy.data.objects if "gridlight_probe_index" in item)
        probe.location.x += 0.2
        yield from pushed("move")

    def delete_a_probe():
        probe = next(item for item in bpy.data.objects if "gridlight_probe_index" in item)
        for item in bpy.context.view_layer.objects:
            item.select_set(item == probe)
        person.do("object.delete")
        yield from choose_volume()

    def move_the_lamp():
        bpy.data.objects["Light"].location.x -= 1
        yield from pushed("lamp")

    def choose_volume():
        bpy.context.view_layer.objects.active = bpy.data.objects["Gridlight Volume"]
        yield 0.05

    def pushed(message):
        person.window.view_layer.update()
        with person.at_viewport():
            bpy.ops.ed.undo_push(message=message)
        yield 0.05

    def dim_and_paint_in_explore_mode():
        assert person.do("gridlight.explore", invoke=True) == {"RUNNING_MODAL"}
        yield 0.3
        yield from person.key("1", "plus", "Escape")
        yield from person.wait_until(lambda: not person.module("operators.explore")._running, "the end of it")

    bpy.context.scene.gridlight.export.directory = str(folder)
    yield from pushed("beginning")
    steps = [
        operator("add_volume"),
        few_probes,
        operator("place_probes"),
        move_a_probe,
        delete_a_probe,
        operator("reset_probes"),
        operator("bake"),
        move_the_lamp,
        operator("relight"),
        dim_and_paint_in_explore_mode,
        grow_the_room,
        operator("fit_volume"),
        operator("clear_probes"),
        operator("clear_bake"),
        operator("add_gallery"),
    ]
    for act in steps:
        before = state()
        yield from act()
        after = state()
        assert after != before, act.__name__
        yield from person.key("ctrl+z")
        assert state() == before, (act.__name__, differences(before, state()))
        yield from person.key("ctrl+shift+z")
        assert state() == after, (act.__name__, differences(after, state()))
        if act.__name__ == "bake":
            assert person.do("gridlight.export") == {"FINISHED"} and (folder / "probes.exr").exists()
            yield from pushed("bake is on the GPU")  # what undo forgot is not what is relit
            assert person.do("gridlight.bake") == {"FINISHED"}
    before = state()
    assert person.do("gridlight.import_field", filepath=str(folder / "probes.exr")) == {"FINISHED"}
    assert state() != before
    yield from person.key("ctrl+z")
    assert state() == before, differences(before, state())


def differences(wanted, seen):
    """What two states do not share."""
    return {
        (kind, name): (wanted[kind].get(name), seen[kind].get(name))
        for kind in wanted
        for name in {*wanted[kind], *seen[kind]}
        if wanted[kind].get(name) != seen[kind].get(name)
    }
