# SPDX-License-Identifier: GPL-3.0-or-later
"""The person that plays the other tests can see, read, click and press keys."""

import bpy
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
