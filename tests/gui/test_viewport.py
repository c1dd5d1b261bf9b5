# SPDX-License-Identifier: GPL-3.0-or-later
"""The preview in the 3D viewport: right colours, every kind of view, and nothing left behind."""

import os

import bpy
import gpu
import lit_room
import numpy as np
from harness import in_blender


@in_blender()
def test_indirect_light_has_the_colours_of_the_closed_form(person):
    """Albedo × radiance, exposed, through the curve that was asked for."""
    lit_room.build(person)
    preview = lit_room.switch(enabled=True, mode="INDIRECT")
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
def test_data_modes_and_probes(person):
    volume = lit_room.build(person)
    preview = lit_room.switch(enabled=True, mode="NORMALS")
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
    lit_room.switch(mode="INDIRECT", show_probes=True, probe_size=0.3)
    lit_room.store_uniform(person, volume, 1.0)
    yield from lit_room.drawn(person)
    person.picture("probes")
    # Spheres show irradiance/π = 1, the floor albedo.
    sphere = np.abs(lit_room.middle(person, share=0.9) - 255).max(axis=2) < 2.0
    assert 0.005 < sphere.mean() < 0.5, sphere.mean()
    preview.enabled = False


@in_blender(backends=("opengl",))
def test_words_can_be_read_before_white(person):
    """The readout says that the scene renders with another view transform; its letters are white, outlined in black."""
    lit_room.build(person, radiance=100.0)
    lit_room.switch(enabled=True, mode="INDIRECT")
    yield from lit_room.drawn(person)
    person.picture("white")
    view = person.rectangle()
    corner = person.look(type(view)(view.x, view.y + view.height - 40, view.width // 2, 40))
    assert (corner > 250).all(axis=2).mean() > 0.8, "white all around"
    dark = (corner < 170).all(axis=2).mean()
    assert 0.02 < dark < 0.2, dark
    lit_room.switch(enabled=False)


@in_blender(backends=("opengl",))
def test_a_click_on_a_sphere_selects_its_probe(person):
    volume = lit_room.build(person)
    probe_objects = person.module("scene.probe_objects")
    grid = person.module("core.grid").Grid(np.array(volume.matrix_world), (3, 3, 3), volume.name)
    probe_objects.place_probes(bpy.context.scene, grid, np.ones(27, np.uint8), volume)
    person.window.view_layer.update()
    lit_room.switch(enabled=True, show_probes=True, probe_size=0.4)
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
    lit_room.switch(enabled=False, show_probes=False)


@in_blender(backends=("opengl",))
def test_quad_view_local_view_and_hidden_objects(person):
    lit_room.build(person)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.6, location=(0, 0, 0))
    ball = bpy.context.object
    lit_room.switch(enabled=True, mode="INDIRECT")
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
    lit_room.switch(enabled=False)


@in_blender(backends=("opengl",))
def test_a_mesh_that_is_edited_is_shown_and_pictures_come_to_rest(person):
    """Looking at it must not count as another edit."""
    lit_room.build(person)
    bpy.context.view_layer.objects.active = bpy.data.objects["Cube"]
    person.do("object.mode_set", mode="EDIT")
    lit_room.switch(enabled=True, mode="INDIRECT")
    yield from lit_room.drawn(person)
    expected = lit_room.display(np.array(lit_room.ALBEDO) * lit_room.RADIANCE)
    assert np.abs(lit_room.middle(person) - expected).max() <= 2.0, lit_room.middle(person)[0, 0]
    person.do("mesh.select_all", action="SELECT")
    person.do("transform.resize", value=(1, 1, 0.5))
    yield from lit_room.drawn(person)
    person.picture("edited")
    height = np.ptp(person.module("viewport.sessions").existing()[0].snapshot.vertices[:, 2])
    assert abs(height - 3.0) < 1e-4, height
    person.do("object.mode_set", mode="OBJECT")
    lit_room.switch(enabled=False)


@in_blender(backends=("opengl",))
def test_two_windows_and_loading_files(person):
    lit_room.build(person)
    lit_room.switch(enabled=True, mode="INDIRECT")
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
    lit_room.switch(enabled=False)
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
    lit_room.switch(enabled=True)
    last = add(look, ("after",), "WINDOW", "POST_VIEW")
    try:
        yield from lit_room.drawn(person)
    finally:
        remove(first, "WINDOW")
        remove(last, "WINDOW")
        lit_room.switch(enabled=False)
    assert len(seen["after"]) > 3 and seen["before"][-3:] == seen["after"][-3:], (seen["before"][-1], seen["after"][-1])


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
