# SPDX-License-Identifier: GPL-3.0-or-later
"""Light in the 3D viewport follows what changes: lamps, objects, the world, playback and undo."""

import bpy
import lit_room
import numpy as np
from harness import in_blender


@in_blender(backends=("opengl",))
def test_lights_that_move_are_noticed(person):
    lit_room.build(person, lamp=True)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.energy = (2.0, 2.0, 0.0), 200
    lit_room.switch(enabled=True, mode="DIRECT", live=False)
    yield from lit_room.drawn(person)
    session = person.module("viewport.sessions").existing()[0]
    gpu_scene, first = session.gpu, lit_room.middle(person)
    lamp.location = (-2.0, -2.0, 0.0)
    yield from lit_room.drawn(person)
    moved = lit_room.middle(person)
    assert np.abs(moved - first).mean() > 5
    assert session.gpu is gpu_scene, "the scene was read again although only a lamp moved"
    lamp.data.energy = 0
    yield from lit_room.drawn(person)
    assert lit_room.middle(person).max() <= 1.0
    with person.at_viewport():
        bpy.ops.mesh.primitive_cube_add(size=0.5)
    yield from lit_room.drawn(person)
    assert session.gpu is not gpu_scene
    gpu_scene = session.gpu
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.2, 0.3, 0.5, 1)
    yield from lit_room.drawn(person)
    assert session.snapshot.world.color[2] > 0.4 and session.gpu is gpu_scene
    for item in bpy.context.view_layer.objects:
        item.select_set(not item.select_get())
    yield 1.0
    assert session.gpu is gpu_scene, "a selection is no change of the scene"
    lit_room.switch(enabled=False)


@in_blender(timeout=240.0)
def test_light_follows_a_lamp_that_moves(person):
    """Indirect light, which only probes carry, comes from where the lamp is, a slice in every frame."""
    volume = lit_room.build(person, radiance=0.0, lamp=True)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.energy, lamp.data.shadow_soft_size = (2.0, 0.0, 0.0), 300, 0.1
    preview = lit_room.switch(enabled=True, mode="INDIRECT", live=True, show_rate=True, frame_budget_ms=100.0)
    lit_room.view(person, distance=0.1, rotation=(1, 0, 0, 0))  # straight down, +x to the right
    session_module = person.module("viewport.sessions")
    yield from person.wait_until(lambda: session_module.existing() and session_module.existing()[0].gpu, "the scene")
    session = session_module.existing()[0]
    assert not session.is_relighting, "light is baked although nothing changed since the bake"
    seen = {}
    for side in (-1.0, 1.0):
        lamp.location.x = 2.5 * side
        yield 0.2
        assert session.is_relighting or session.is_pending
        yield from person.wait_until(lambda: not (session.is_relighting or session.is_pending), "new light", 90.0)
        yield from lit_room.drawn(person)
        person.picture(f"lamp{side:+.0f}")
        seen[side] = lit_room.middle(person, share=0.8).mean(axis=(0, 2))
        assert session.readout.probes_per_frame > 0 and session.readout.age_seconds == 0
    third = len(seen[1.0]) // 3
    for side, brightness in seen.items():
        left, right = brightness[:third].mean(), brightness[-third:].mean()
        assert (right > left + 3) if side > 0 else (left > right + 3), (side, left, right)
    stored = person.module("scene.field_storage").load_field(volume)
    assert not stored.coefficients.any(), "what was baked and stored is not changed by looking"
    preview.enabled, preview.show_rate = False, False


@in_blender(backends=("opengl",), timeout=240.0)
def test_light_follows_during_playback_and_undo(person):
    lit_room.build(person, radiance=0.0, lamp=True)
    scene, lamp = bpy.context.scene, bpy.data.objects["Light"]
    lamp.data.energy = 300
    for frame, x in ((1, -2.5), (40, 2.5)):
        lamp.location = (x, 0, 0)
        lamp.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    scene.frame_end = 40
    lit_room.switch(enabled=True, mode="INDIRECT", live=True, frame_budget_ms=100.0)
    with person.at_viewport():
        bpy.ops.ed.undo_push(message="lamp")
    sessions = person.module("viewport.sessions")
    yield from person.wait_until(lambda: sessions.existing() and sessions.existing()[0].gpu, "the scene")
    session = sessions.existing()[0]
    with person.at_viewport():
        bpy.ops.screen.animation_play()
    read = person.module("gpu_shaders.textures").read
    lights = []

    def has_followed_twice():
        field = session.gpu.fields["Room"]
        light = read(field.light_textures[0], field.field.coefficients.shape[0] * field.field.coefficients.shape[1])
        if not lights or not np.allclose(lights[-1], light, rtol=0.05, atol=0.01):
            lights.append(light)
        return len(lights) > 3  # what was stored is the first

    yield from person.wait_until(has_followed_twice, "light that follows playback", 120.0, step=0.3)
    assert session.readout.probes_per_frame > 0 and session.readout.age_seconds > 0
    with person.at_viewport():
        bpy.ops.screen.animation_cancel(restore_frame=True)
    yield from person.wait_until(lambda: not session.is_relighting, "rest", 60.0)
    with person.at_viewport():
        bpy.ops.mesh.primitive_cube_add(size=1.0)
        bpy.ops.ed.undo_push(message="cube")
    yield from person.wait_until(lambda: not (session.is_relighting or session.is_pending), "light around a cube", 60.0)
    triangles = len(session.snapshot.triangles)
    with person.at_viewport():
        bpy.ops.ed.undo()
    yield 0.5
    assert bpy.context.scene.gridlight.preview.enabled
    session = sessions.existing()[0]
    yield from person.wait_until(lambda: not (session.is_relighting or session.is_pending), "light without it", 60.0)
    assert len(session.snapshot.triangles) == triangles - 12
    assert not session.message, session.message
    handlers = person.module("viewport.handlers")
    bpy.context.scene.gridlight.preview.enabled = False
    assert not handlers._draw_handles
    with person.at_viewport():
        bpy.ops.ed.undo()
    yield 0.3
    assert bool(handlers._draw_handles) == bpy.context.scene.gridlight.preview.enabled
    bpy.context.scene.gridlight.preview.enabled = False


@in_blender(backends=("opengl",), timeout=180.0)
def test_previews_rest_while_a_bake_runs(person):
    """Its light takes the place of theirs, and they would take the time of the bake. What is edited is seen."""
    volume = lit_room.build(person, lamp=True)
    volume.gridlight_grid.resolution = (9, 9, 9)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.energy = (2.0, 0.0, 0.0), 300
    person.window.view_layer.objects.active = volume
    lit_room.switch(enabled=True, live=True)
    yield from lit_room.drawn(person)
    operators, handlers = person.module("operators.bake"), person.module("viewport.handlers")
    session = person.module("viewport.sessions").existing()[0]
    assert person.do("gridlight.bake", invoke=True) == {"RUNNING_MODAL"}
    yield 0.1
    before, follows, samples = session.version, [], []
    while operators.running_task() is not None:
        lamp.location.x -= 0.01
        follows.append(session._live.is_working)
        samples += [image.picture.samples for image in handlers.images._images.values() if session.version > before]
        yield 0.05
    assert samples and max(samples) == 1 and not any(follows), (samples, follows)
    yield from lit_room.drawn(person)
    finished = person.module("viewport.view_images").SAMPLES
    assert [image.picture.samples for image in handlers.images._images.values()] == [finished]
    lit_room.switch(enabled=False)
