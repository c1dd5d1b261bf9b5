# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview in the 3D viewport: right colours, every kind of view, and nothing left behind."""

import os

import bpy
import gpu
import lit_room
import numpy as np
from harness import in_blender


def switch(person, **settings):
    preview = bpy.context.scene.gridlight.preview
    for name, value in settings.items():
        setattr(preview, name, value)
    return preview


@in_blender()
def test_indirect_light_has_the_colours_of_the_closed_form(person):
    """Albedo × radiance, exposed, through the curve that was asked for."""
    lit_room.build(person)
    preview = switch(person, enabled=True, mode="INDIRECT")
    linear = np.array(lit_room.ALBEDO) * lit_room.RADIANCE
    yield from lit_room.drawn(person)
    person.picture("indirect")
    assert np.abs(lit_room.middle(person) - lit_room.display(linear)).max() <= 2.0, lit_room.middle(person)[0, 0]
    preview.exposure = 1.0
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person) - lit_room.display(2 * linear)).max() <= 2.0
    preview.exposure, bpy.context.scene.view_settings.exposure = 0.0, -1.0
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person) - lit_room.display(linear / 2)).max() <= 2.0
    bpy.context.scene.view_settings.exposure = 0.0
    preview.tone_curve = "LINEAR"
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person) - 255 * linear).max() <= 2.0, lit_room.middle(person)[0, 0]
    preview.tone_curve, preview.indirect = "STANDARD", 0.5
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person) - lit_room.display(linear / 2)).max() <= 2.0
    preview.mode = "IRRADIANCE"
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person) - lit_room.display([lit_room.RADIANCE / 2] * 3)).max() <= 2.0
    preview.mode = "DIRECT"
    yield from lit_room.drawn(person)
    assert lit_room.middle(person).max() <= 1.0
    preview.enabled = False


@in_blender()
def test_the_render_engine_shows_what_the_preview_shows(person):
    """View draw under Blender's own Standard view; a finished image; and the overlay that knows no view transform."""
    lit_room.build(person, lamp=True)
    scene = bpy.context.scene
    bpy.data.objects["Light"].location = (1.0, -0.6, 1.5)
    bpy.data.objects["Light"].data.energy = 120
    scene.view_settings.view_transform = "Standard"
    preview = switch(person, enabled=True)
    yield from lit_room.drawn(person)
    person.picture("preview")
    preview_pixels = lit_room.middle(person)
    assert preview_pixels.std() > 10
    preview.enabled = False
    scene.render.engine = "GRIDLIGHT"
    person.area().spaces.active.shading.type = "RENDERED"
    yield from lit_room.drawn(person)
    person.picture("engine")
    difference = np.abs(lit_room.middle(person) - preview_pixels)
    assert np.percentile(difference, 99) <= 4.0 and difference.mean() < 1.0, (difference.mean(), difference.max())
    person.area().spaces.active.shading.type = "SOLID"
    sessions = person.module("viewport.sessions")
    yield from person.wait_until(lambda: not sessions.existing(), "the end of a session that nobody needs")
    yield 0.3


@in_blender()
def test_f12_renders_while_the_preview_goes_on(person):
    """The image is made in a thread of its own, with the viewport drawing beside it."""
    lit_room.build(person)
    scene = bpy.context.scene
    scene.render.engine = "GRIDLIGHT"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 160, 90, 100
    scene.camera.location = (0, 0, 0)
    scene.view_settings.view_transform = "Standard"
    bpy.context.preferences.view.render_display_type = "NONE"
    switch(person, enabled=True, mode="INDIRECT")
    yield from lit_room.drawn(person)
    seen = []
    bpy.app.handlers.render_complete.append(lambda *_: seen.append(True))
    try:
        with person.at_viewport():
            bpy.ops.render.render("INVOKE_DEFAULT")
        for _ in range(600):
            if seen:
                break
            person.area().spaces.active.region_3d.view_distance *= 1.01
            yield 0.05
    finally:
        bpy.app.handlers.render_complete.pop()
    path = os.path.join(bpy.app.tempdir, "render.png")
    bpy.data.images["Render Result"].save_render(path)
    image = bpy.data.images.load(path)
    pixels = np.array(image.pixels[:]).reshape(90, 160, 4)[..., :3] * 255
    bpy.data.images.remove(image)
    os.remove(path)
    expected = lit_room.display(np.array(lit_room.ALBEDO) * lit_room.RADIANCE)
    assert np.abs(pixels - expected).max() <= 1.5, np.abs(pixels - expected).max()
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person, share=0.3) - expected).max() <= 2.0
    switch(person, enabled=False)
    bpy.context.preferences.view.render_display_type = "WINDOW"


@in_blender()
def test_data_modes_and_probes(person):
    volume = lit_room.build(person)
    preview = switch(person, enabled=True, mode="NORMALS")
    lit_room.view(person, rotation=(1, 0, 0, 0))  # straight down on the floor
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person, share=0.2) - [127.5, 127.5, 255]).max() <= 2.0
    preview.mode = "VALIDITY"
    yield from lit_room.drawn(person)
    person.picture("validity")
    red, green, blue = lit_room.middle(person, share=0.2).mean(axis=(0, 1))
    assert green > 1.5 * red and green > 1.5 * blue
    preview.mode = "ERROR"
    yield from lit_room.drawn(person)
    person.picture("error")
    red, green, blue = lit_room.middle(person, share=0.2).mean(axis=(0, 1))
    assert blue > 2 * red and blue > 2 * green  # the field is uniform: no error
    switch(person, mode="INDIRECT", show_probes=True, probe_size=0.3)
    lit_room.store_uniform(person, volume, 1.0)
    yield from lit_room.drawn(person)
    person.picture("probes")
    # Spheres show irradiance/π = 1, the floor albedo.
    sphere = np.abs(lit_room.middle(person, share=0.9) - 255).max(axis=2) < 2.0
    assert 0.005 < sphere.mean() < 0.5, sphere.mean()
    preview.enabled = False


@in_blender(backends=("opengl",))
def test_a_click_on_a_sphere_selects_its_probe(person):
    volume = lit_room.build(person)
    probe_objects = person.module("scene.probe_objects")
    grid = person.module("core.grid").Grid(np.array(volume.matrix_world), (3, 3, 3), volume.name)
    probe_objects.place_probes(bpy.context.scene, grid, np.ones(27, np.uint8), volume)
    person.window.view_layer.update()
    switch(person, enabled=True, show_probes=True, probe_size=0.4)
    lit_room.view(person, distance=2.3, rotation=(1, 0, 0, 0))
    yield from lit_room.drawn(person)
    for item in bpy.context.view_layer.objects:
        item.select_set(False)
    from bpy_extras import view3d_utils

    region, region_3d = person.region(), person.area().spaces.active.region_3d
    node = 1 + 3 * (1 + 3 * 0)  # the middle of the lowest layer
    place = view3d_utils.location_3d_to_region_2d(region, region_3d, grid.positions()[node])
    rectangle = person.rectangle(region)
    # The probe in the middle of the room stands before it: look past that one.
    x, y = int(rectangle.x + place.x), int(rectangle.y + rectangle.height - place.y)
    yield from person.click(x, y)
    person.picture("picked")
    selected = [item for item in bpy.context.view_layer.objects if item.select_get()]
    assert len(selected) == 1, selected
    assert selected[0][probe_objects.VOLUME_PROPERTY] == "Room"
    index = selected[0][probe_objects.INDEX_PROPERTY]
    assert index in (node, node + 9)  # whichever is nearer to the eye
    switch(person, enabled=False, show_probes=False)


@in_blender(backends=("opengl",))
def test_quad_view_local_view_and_hidden_objects(person):
    lit_room.build(person)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6, location=(0, 0, 0))
    ball = bpy.context.object
    switch(person, enabled=True, mode="INDIRECT")
    lit_room.view(person, distance=4.0)
    yield from lit_room.drawn(person)
    person.picture("both")
    both = lit_room.middle(person, share=0.9)
    grey = lit_room.display([0.8 * lit_room.RADIANCE] * 3)  # the ball has no material
    ball_pixels = np.abs(both - grey).max(axis=2) < 3
    assert 0.01 < ball_pixels.mean() < 0.5
    ball.hide_set(True)
    yield from lit_room.drawn(person)
    assert (np.abs(lit_room.middle(person, share=0.9) - grey).max(axis=2) < 3).mean() < 1e-3
    ball.hide_set(False)
    ball.select_set(True)
    with person.at_viewport():
        bpy.ops.view3d.localview(frame_selected=False)
    yield from lit_room.drawn(person)
    person.picture("local")
    local = lit_room.middle(person, share=0.9)
    assert (np.abs(local - grey).max(axis=2) < 3).mean() > 0.01
    room = np.abs(local - lit_room.display(np.array(lit_room.ALBEDO) * lit_room.RADIANCE)).max(axis=2) < 3
    assert room.mean() < 0.01
    with person.at_viewport():
        bpy.ops.view3d.localview(frame_selected=False)
        bpy.ops.screen.region_quadview()
    yield from lit_room.drawn(person)
    person.picture("quad")
    views = [region for region in person.area().regions if region.type == "WINDOW"]
    assert len(views) == 4
    with person.at_viewport():
        bpy.ops.screen.region_quadview()
    yield from lit_room.drawn(person)
    assert len(person.module("viewport.handlers").images._images) == 1, "views that are gone hold pictures"
    switch(person, enabled=False)


@in_blender(backends=("opengl",))
def test_two_windows_and_loading_files(person):
    lit_room.build(person)
    switch(person, enabled=True, mode="INDIRECT")
    before = {window for window in bpy.context.window_manager.windows}
    with person.at_viewport():
        bpy.ops.screen.area_dupli("INVOKE_DEFAULT")
    yield from lit_room.drawn(person)
    second = next(window for window in bpy.context.window_manager.windows if window not in before)
    handlers = person.module("viewport.handlers")
    assert len(handlers.images._images) == 2
    with bpy.context.temp_override(window=second):
        bpy.ops.wm.window_close()
    path = os.path.join(bpy.app.tempdir, "preview.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path, compress=False)
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 0.5
    assert not handlers._draw_handles and not person.module("viewport.sessions").existing()
    assert not bpy.app.timers.is_registered(handlers._tick)
    bpy.ops.wm.open_mainfile(filepath=path)
    yield from lit_room.drawn(person)
    person.picture("reloaded")
    expected = lit_room.display(np.array(lit_room.ALBEDO) * lit_room.RADIANCE)
    assert np.abs(lit_room.middle(person) - expected).max() <= 2.0
    switch(person, enabled=False)
    yield 0.3
    assert not handlers._draw_handles and not handlers.images._images
    os.remove(path)


@in_blender()
def test_gpu_state_is_as_it_was(person):
    """A handler that draws after ours finds what one before it found."""
    lit_room.build(person)
    seen = {"before": [], "after": []}

    def look(where):
        state = gpu.state
        seen[where].append((state.blend_get(), state.depth_test_get(), state.depth_mask_get(), state.viewport_get()))

    add, remove = bpy.types.SpaceView3D.draw_handler_add, bpy.types.SpaceView3D.draw_handler_remove
    first = add(look, ("before",), "WINDOW", "POST_VIEW")
    switch(person, enabled=True)
    last = add(look, ("after",), "WINDOW", "POST_VIEW")
    try:
        yield from lit_room.drawn(person)
    finally:
        remove(first, "WINDOW")
        remove(last, "WINDOW")
        switch(person, enabled=False)
    assert len(seen["after"]) > 3 and seen["before"][-3:] == seen["after"][-3:], (seen["before"][-1], seen["after"][-1])


@in_blender(backends=("opengl",))
def test_lights_that_move_are_noticed(person):
    lit_room.build(person, lamp=True)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.energy = (2.0, 2.0, 0.0), 200
    switch(person, enabled=True, mode="DIRECT", live=False)
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
    switch(person, enabled=False)


@in_blender(timeout=240.0)
def test_light_follows_a_lamp_that_moves(person):
    """Indirect light, which only probes carry, comes from where the lamp is, a slice in every frame."""
    volume = lit_room.build(person, radiance=0.0, lamp=True)
    lamp = bpy.data.objects["Light"]
    lamp.location, lamp.data.energy, lamp.data.shadow_soft_size = (2.0, 0.0, 0.0), 300, 0.1
    preview = switch(person, enabled=True, mode="INDIRECT", live=True, show_rate=True, frame_budget_ms=100.0)
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


@in_blender(backends=("opengl",))
def test_many_probes_are_points(person):
    lit_room.build(person)
    space = lit_room.view(person, distance=14.0)
    space.overlay.show_overlays = True
    space.overlay.show_floor = space.overlay.show_axis_x = space.overlay.show_axis_y = False
    volume = bpy.data.objects["Room"]
    volume.gridlight_grid.resolution = (20, 20, 20)
    bpy.data.objects["Cube"].display_type = "WIRE"

    def orange():
        red, green, blue = np.moveaxis(lit_room.middle(person), 2, 0)
        return ((red > 180) & (green < 0.9 * red) & (green > 0.6 * red) & (blue < 0.7 * green)).mean()

    bpy.context.view_layer.objects.active = volume
    person.do("gridlight.place_probes")
    yield 1.0
    person.picture("points")
    assert orange() > 0.02
    with person.at_viewport():
        bpy.ops.ed.undo()
    yield 1.0
    points = person.module("viewport.points")
    assert list(points._batches.values()) == [None]  # drawn since, and nothing was there
    points.stop()


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
    switch(person, enabled=True, mode="INDIRECT", live=True, frame_budget_ms=100.0)
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
