# SPDX-License-Identifier: GPL-3.0-or-later
"""The sidebar's tab and the Add menu as a person sees and uses them."""

import bpy
from harness import in_blender


@in_blender()
def test_gallery_from_the_add_menu_opens_the_tab(person):
    menu_bar = person.rectangle(person.region("HEADER"))
    yield from person.click_text("Add", menu_bar)
    yield from person.click_text("Gridlight Gallery", person.rectangle())
    yield 1.5
    assert person.window.scene.name == "Gridlight Gallery"
    assert bpy.data.objects["Cube"].name in bpy.data.scenes["Scene"].objects
    person.picture("gallery")
    sidebar = person.rectangle(person.region("UI"))
    for title in ("Volume", "Bake", "Preview", "Export"):
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
