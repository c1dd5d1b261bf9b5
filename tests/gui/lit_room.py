# SPDX-License-Identifier: GPL-3.0-or-later
"""A room whose light is known in closed form, a view into it, and what screens show of it."""

import bpy
import numpy as np

RADIANCE = 0.4  # of the field, the same from everywhere
ALBEDO = (0.8, 0.5, 0.25)


def build(person, radiance=RADIANCE, lamp=False):
    """A 6 m cube seen from inside, with a uniform field: every surface shows albedo × radiance of indirect light."""
    volumes = person.module("scene.volumes")
    person.module("viewport.view_images").SAMPLES = 2  # enough for plain colours
    bpy.context.scene.gridlight.preview.live = False  # the light shall stay as it is known
    cube = bpy.data.objects["Cube"]
    cube.scale = (3, 3, 3)
    principled = cube.active_material.node_tree.nodes["Principled BSDF"].inputs
    principled["Base Color"].default_value = (*ALBEDO, 1)
    principled["Specular IOR Level"].default_value = 0.0  # what it mirrors is spread as well and would add to ALBEDO
    if not lamp:
        bpy.data.objects.remove(bpy.data.objects["Light"])
    bpy.context.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    volume = volumes.create_volume(bpy.context.scene, "Room", np.diag([2.5, 2.5, 2.5, 1.0]), (3, 3, 3))
    person.window.view_layer.update()
    store_uniform(person, volume, radiance)
    view(person)
    return volume


def store_uniform(person, volume, radiance):
    """Gives ``volume`` a field of the same radiance everywhere."""
    grid = person.module("core.grid").Grid(
        person.module("scene.volumes").box_of(volume), person.module("scene.volumes").resolution_of(volume), volume.name
    )
    field = person.module("core.field").Field.empty(grid, 3)
    field.coefficients[:, 0] = radiance * np.sqrt(4 * np.pi)
    field.depth[..., :2] = 100.0, 10000.0
    person.module("scene.field_storage").store_field(volume, field, "known light")
    person.module("viewport").field_changed(volume)


def switch(**settings):
    """Sets the preview's properties; returns them."""
    preview = bpy.context.scene.gridlight.preview
    for name, value in settings.items():
        setattr(preview, name, value)
    return preview


def view(person, distance=2.0, rotation=(0.8, 0.35, 0.2, 0.4)):
    """Looks into the room with nothing on top of the picture."""
    space = person.area().spaces.active
    space.overlay.show_overlays = False
    space.show_gizmo = False
    space.show_region_ui = space.show_region_toolbar = False
    region_3d = space.region_3d
    region_3d.view_perspective = "PERSP"
    region_3d.view_location, region_3d.view_distance = (0, 0, 0), distance
    region_3d.view_rotation = np.array(rotation) / np.linalg.norm(rotation)
    return space


def is_drawn(person):
    """Whether the pictures of all views are finished."""
    handlers = person.module("viewport.handlers")
    session = next(iter(person.module("viewport.sessions").existing()), None)
    if session is None or session.gpu is None or session.is_pending:
        return False
    return not any(handlers.images.needs_drawing(area) for area, _ in handlers._views())


def drawn(person, seconds=40.0):
    """Waits until what the views show is finished."""
    yield 0.3  # settings made by scripts are noticed five times a second
    yield from person.wait_until(lambda: is_drawn(person), "a finished picture", seconds)
    yield 0.15


def middle(person, region=None, share=0.5):
    """(height, width, 3) sRGB 0..255 of the middle of a region."""
    place = person.rectangle(region)
    screen = person.look().astype(float)
    high, wide = int(place.height * share / 2), int(place.width * share / 2)
    x, y = place.center
    return screen[y - high : y + high, x - wide : x + wide]


def display(linear):
    """sRGB 0..255 of linear light, by IEC 61966-2-1."""
    linear = np.clip(np.asarray(linear, float), 0, 1)
    return 255 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
