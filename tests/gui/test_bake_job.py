# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake as a modal job: Blender stays usable, and whatever happens in the middle ends it cleanly."""

import bpy
import numpy as np
from harness import in_blender
from person import Rectangle

STATUS_BAR_PIXELS = 24


def room(person):
    """A room with a lamp and a volume that takes a while to bake."""
    volumes = person.module("scene.volumes")
    cube = bpy.data.objects["Cube"]
    cube.scale = (3, 3, 3)
    volume = volumes.create_volume(bpy.context.scene, "Room", np.diag([2.5, 2.5, 2.5, 1.0]), (9, 9, 9))
    bpy.data.objects["Light"].location = (0.5, 0.4, 1.5)
    person.window.view_layer.objects.active = volume
    bpy.context.scene.gridlight.keep_all = True
    person.window.view_layer.update()
    with person.at_viewport():
        bpy.ops.ed.undo_push(message="room")
    return volume


def start(person):
    assert person.do("gridlight.bake", invoke=True) == {"RUNNING_MODAL"}
    yield 0.1
    assert person.module("operators.bake").running_task() is not None


def status_bar(person):
    """The lowest line of the window."""
    window = person.window
    return Rectangle(0, window.height - STATUS_BAR_PIXELS, window.width, STATUS_BAR_PIXELS)


def has_ended(person):
    bake = person.module("operators.bake")
    assert bake.running_task() is None
    return bake.last_failure()


@in_blender()
def test_bake_shows_progress_and_stores_light(person):
    volume = room(person)
    storage = person.module("scene.field_storage")
    yield from person.open_tab()
    person.do("gridlight.bake", invoke=True)
    seen, taken = [], set()
    task = person.module("operators.bake").running_task()
    while person.module("operators.bake").running_task() is not None and len(seen) < 600:
        seen.append((task.progress.share, str(task.progress)))
        if "Bouncing" in seen[-1][1] and "running" not in taken:
            taken.add("running")
            person.picture("running")
            assert person.find("cancel", status_bar(person))
        yield 0.02
    shares = [share for share, _ in seen]
    assert shares == sorted(shares) and shares[-1] > 0.3, shares
    assert len({text.split(" ")[0] for _, text in seen}) >= 3, seen
    assert has_ended(person) == ""
    assert "729 probes" in storage.stored_details(volume)["outcome"]
    assert storage.load_field(volume).coefficients[:, 0].max() > 0
    stale = person.module("operators.stale")
    yield from person.wait_until(lambda: stale.state_of(bpy.context.scene, volume) == stale.FRESH, "its state", 20)
    yield 0.5
    person.picture("done")
    assert person.find("up to date", person.rectangle(person.region("UI")))


@in_blender(backends=("opengl",))
def test_escape_cancels_and_leaves_everything(person):
    volume = room(person)
    storage = person.module("scene.field_storage")
    yield from start(person)
    yield from person.key("Escape")
    yield 0.3
    assert "cancelled" in has_ended(person)
    assert storage.load_field(volume) is None and not bpy.data.texts


@in_blender(backends=("opengl",))
def test_undo_in_the_middle(person):
    room(person)
    bpy.context.scene.gridlight.face = 24
    with person.at_viewport():
        bpy.ops.ed.undo_push(message="face")
    yield from start(person)
    yield from person.key("ctrl+z")
    yield 0.3
    assert "given up" in has_ended(person)
    assert bpy.context.scene.gridlight.face == 16 and not bpy.data.texts


@in_blender(backends=("opengl",))
def test_deleting_the_volume_in_the_middle(person):
    volume = room(person)
    yield from start(person)
    bpy.data.objects.remove(volume)
    yield 0.3
    assert "deleted" in has_ended(person)


@in_blender(backends=("opengl",))
def test_deleting_something_else_goes_on_and_is_stale(person):
    volume = room(person)
    yield from start(person)
    task = person.module("operators.bake").running_task()
    yield from person.wait_until(lambda: task.progress.phase_name != "read", "the scene to be read", step=0.01)
    bpy.data.objects.remove(bpy.data.objects["Light"])
    yield from person.wait_until(lambda: person.module("operators.bake").running_task() is None, "the bake", 60)
    stale = person.module("operators.stale")
    yield from person.wait_until(lambda: stale.state_of(bpy.context.scene, volume) == stale.STALE, "its state", 10)


@in_blender(backends=("opengl",))
def test_changing_the_mode_in_the_middle(person):
    room(person)
    person.window.view_layer.objects.active = bpy.data.objects["Cube"]
    yield from start(person)
    yield from person.key("Tab")
    yield 0.3
    assert "mode" in has_ended(person)
    assert bpy.data.objects["Cube"].mode == "EDIT"


@in_blender(backends=("opengl",))
def test_loading_a_file_in_the_middle(person):
    room(person)
    yield from start(person)
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 0.3
    assert "given up" in has_ended(person)
    assert "Room" not in bpy.data.objects
    assert not person.find("cancel", status_bar(person))


@in_blender(backends=("opengl",))
def test_switching_the_extension_off_in_the_middle(person):
    import addon_utils
    from person import EXTENSION

    room(person)
    yield from start(person)
    addon_utils.disable(EXTENSION)
    yield 0.3
    assert not hasattr(bpy.types.Scene, "gridlight")
    running = [operator.bl_idname for operator in person.window.modal_operators if operator]
    addon_utils.enable(EXTENSION)
    assert not running, running
    yield 0.2


@in_blender(backends=("opengl",))
def test_blender_stays_usable_during_a_bake(person):
    room(person)
    yield from start(person)
    with person.at_viewport():
        bpy.ops.object.select_all(action="DESELECT")
    yield from person.key("a")
    assert bpy.data.objects["Cube"].select_get()
    yield from person.wait_until(lambda: person.module("operators.bake").running_task() is None, "the bake", 60)
    assert has_ended(person) == ""


@in_blender(backends=("opengl",))
def test_undo_takes_a_bake_back_and_redo_brings_it_again(person):
    room(person)
    storage = person.module("scene.field_storage")
    yield from start(person)
    yield from person.wait_until(lambda: person.module("operators.bake").running_task() is None, "the bake", 60)
    assert storage.load_field(bpy.data.objects["Room"]) is not None
    yield from person.key("ctrl+z")
    assert storage.load_field(bpy.data.objects["Room"]) is None
    yield from person.key("ctrl+shift+z")
    assert storage.load_field(bpy.data.objects["Room"]) is not None
