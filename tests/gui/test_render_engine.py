# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine "Gridlight": in the viewport, on F12, under Blender's colour management."""

import os

import bpy
import lit_room
import numpy as np
from harness import in_blender
from person import Rectangle


@in_blender()
def test_the_render_engine_shows_what_the_preview_shows(person):
    """View draw under Blender's own Standard view; a finished image; and the overlay that knows no view transform."""
    lit_room.build(person, lamp=True)
    scene = bpy.context.scene
    bpy.data.objects["Light"].location = (1.0, -0.6, 1.5)
    bpy.data.objects["Light"].data.energy = 120
    scene.view_settings.view_transform = "Standard"
    preview = lit_room.switch(enabled=True)
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
    lit_room.switch(enabled=True, mode="INDIRECT")
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
    pixels = 255 * pixels_of(path)
    expected = lit_room.display(np.array(lit_room.ALBEDO) * lit_room.RADIANCE)
    assert np.abs(pixels - expected).max() <= 1.5, np.abs(pixels - expected).max()
    yield from lit_room.drawn(person)
    assert np.abs(lit_room.middle(person, share=0.3) - expected).max() <= 2.0
    lit_room.switch(enabled=False)
    bpy.context.preferences.view.render_display_type = "WINDOW"


@in_blender()
def test_a_rendered_image_is_under_blenders_colour_management(person):
    """Rendered from the menu; then the file that the operator writes. Blender brings plain colours of known light to
    the same view by itself: that is what the image must show."""
    lit_room.build(person)
    scene = bpy.context.scene
    scene.camera.location = (0, 0, 0)
    scene.render.engine = "GRIDLIGHT"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 96, 54, 100
    scene.view_settings.view_transform, scene.view_settings.exposure = "AgX", 0.7
    linear = np.array(lit_room.ALBEDO) * lit_room.RADIANCE
    known = bpy.data.images.new("Known", 96, 54, float_buffer=True)
    known.colorspace_settings.name = "Linear Rec.709"
    known.pixels.foreach_set(np.tile(np.float32([*linear, 1]), 96 * 54))
    bpy.context.preferences.view.render_display_type = "NONE"
    seen = []
    bpy.app.handlers.render_complete.append(lambda *_: seen.append(True))
    try:
        yield from person.click_text("Render", Rectangle(0, 0, 600, 30))
        yield from person.click_text("Render Image", Rectangle(100, 20, 400, 200))
        yield from person.wait_until(lambda: seen, "the image", 60)
    finally:
        bpy.app.handlers.render_complete.pop()
    path = os.path.join(bpy.app.tempdir, "rendered.png")
    bpy.data.images["Render Result"].save_render(path)
    shown = pixels_of(path)
    known.save_render(path, scene=scene)
    expected = pixels_of(path)
    assert 10 < 255 * np.ptp(expected[0, 0]), "the view must tell colours apart"
    assert 255 * np.abs(shown - expected).max() <= 1.5, (255 * shown[0, 0], 255 * expected[0, 0])
    scene.render.filepath = os.path.join(bpy.app.tempdir, "rendered.exr")
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    with person.at_viewport():
        bpy.ops.render.render("EXEC_DEFAULT", write_still=True)
    assert np.abs(pixels_of(scene.render.filepath) - linear).max() <= 2e-3, "files of linear light know no view"
    bpy.context.preferences.view.render_display_type = "WINDOW"


def pixels_of(path):
    """(height, width, 3) of an image file, 0..1 as it lies in the file; the file is removed."""
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.array(image.pixels[:]).reshape(height, width, -1)[..., :3]
    bpy.data.images.remove(image)
    os.remove(path)
    return pixels
