# SPDX-License-Identifier: GPL-3.0-or-later
"""The person that plays the other tests can see, read, click and press keys, and notices what is left behind."""

import bpy
import gpu
import leaks
from harness import in_blender


@in_blender()
def test_person_sees_reads_and_acts(person):
    assert person.area().type == "VIEW_3D"
    screen = person.look()
    assert screen.shape == (800, 1280, 3) and screen.std() > 10
    yield from person.open_tab("View")
    assert person.find("Focal Length", person.rectangle(person.region("UI")))
    cube = bpy.data.objects["Cube"]
    assert cube.select_get()
    yield from person.key("alt+a")
    assert not cube.select_get()
    yield from person.key("ctrl+z")
    assert bpy.data.objects["Cube"].select_get()
    yield from person.click_text("Annotations")
    person.picture("sidebar")


@in_blender(backends=("opengl",))
def test_what_is_left_behind_is_seen(person):
    """Each kind, left on purpose."""

    def left():
        return 1000.0

    left.__module__ = "left_behind.module"
    bpy.app.timers.register(left, first_interval=1000.0)
    drawing = bpy.types.SpaceView3D.draw_handler_add(left, (), "WINDOW", "POST_VIEW")
    bpy.app.handlers.undo_post.append(left)
    timer = bpy.context.window_manager.event_timer_add(0.05, window=person.window)
    textures = leaks.gpu_objects()["GPUTexture"]
    held = [gpu.types.GPUTexture((4, 4))]
    name = f"left_behind.module.{left.__qualname__}"
    try:
        assert leaks.timers("left_behind") == {name: 1}
        assert leaks.draw_handlers("left_behind") == {f"SpaceView3D WINDOW POST_VIEW {name}": 1}
        assert leaks.application_handlers("left_behind") == {"undo_post": 1}
        assert leaks.gpu_objects()["GPUTexture"] == textures + 1
        assert (yield from leaks.event_timers()) > 0
    finally:
        bpy.app.timers.unregister(left)
        bpy.types.SpaceView3D.draw_handler_remove(drawing, "WINDOW")
        bpy.app.handlers.undo_post.remove(left)
        bpy.context.window_manager.event_timer_remove(timer)
        held.clear()
    assert not leaks.timers("left_behind") and not leaks.draw_handlers("left_behind")
    assert not leaks.application_handlers("left_behind") and leaks.gpu_objects()["GPUTexture"] == textures
    assert (yield from leaks.event_timers()) == 0
