# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's tab and the Add menu as a person sees and uses them."""

import bpy
import numpy as np
from harness import in_blender


@in_blender(backends=("opengl",))
def test_gallery_from_the_add_menu_opens_the_tab(person):
    menu_bar = person.rectangle(person.region("HEADER"))
    yield from person.click_text("Add", menu_bar)
    yield from person.click_text("Gridlight Gallery", person.rectangle())
    yield 1.5
    assert person.window.scene.name == "Gridlight Gallery"
    assert bpy.data.objects["Cube"].name in bpy.data.scenes["Scene"].objects
    person.picture("gallery")
    sidebar = person.rectangle(person.region("UI"))
    for title in ("Volume", "Bake", "Lights", "Preview"):  # Export is farther down
        assert person.find(title, sidebar), title


@in_blender(backends=("opengl",))
def test_empty_scene_says_what_to_do(person):
    yield from person.open_tab()
    person.picture("empty")
    yield from person.click_text("Add Volume")
    yield 0.3
    assert bpy.context.view_layer.objects.active["gridlight_volume"] == 1
    person.picture("volume")
    yield from person.key("ctrl+z")
    assert not [item for item in bpy.data.objects if "gridlight_volume" in item]


@in_blender(backends=("opengl",))
def test_lights_are_listed_with_role_group_and_intensity(person):
    person.do("gridlight.add_gallery")
    yield 0.5
    scene = person.window.scene
    names = [item.name for item in scene.objects]
    scene.gridlight.active_light = names.index("Wandering lamp")
    yield from person.open_tab()
    for title in ("Volume", "Bake", "Preview", "Export"):
        yield from person.click_text(title)  # closes the panel
    yield from person.click_text("Lights")
    yield 0.3
    person.picture("lights")
    sidebar = person.rectangle(person.region("UI"))
    for text in ("Hall ceiling", "Wandering lamp", "Role", "Group", "Intensity"):
        assert person.find(text, sidebar), text


@in_blender(backends=("opengl",))
def test_several_volumes_are_listed_and_chosen(person):
    volumes = person.module("scene.volumes")
    scene = bpy.context.scene
    turned = np.eye(4)
    turned[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    volumes.create_volume(scene, "Attic", turned * [2, 1, 1, 1], (5, 3, 3))
    volumes.create_volume(scene, "Cellar", np.diag([2.0, 2.0, 1.0, 1.0]), (4, 4, 3))
    person.window.view_layer.objects.active = bpy.data.objects["Cube"]
    yield from person.open_tab()
    person.picture("volumes")
    yield from person.click_text("Attic")
    assert person.window.view_layer.objects.active.name == "Attic"
    yield from person.click_text("Place")
    yield 0.3
    person.picture("placed")
    yield from person.click_text("Settings")
    person.picture("settings")
