# SPDX-License-Identifier: GPL-3.0-or-later
"""``docs/getting_started.md`` word by word: whatever stands there in bold is found on the screen and clicked, in its
order, and what it says of the rest is done and looked at. The pictures of the guide are those that this test takes.

The session that runs it has installed the zip, which is the guide's first step.
"""

import re
from pathlib import Path

import bpy
import lit_room
import numpy as np
from harness import in_blender
from person import Rectangle

GUIDE = Path(__file__).parents[2] / "docs" / "getting_started.md"
CHECKBOX_PIXELS = 12  # from the title of a panel to the box before it
MENU_PIXELS = 160  # wide


class Reader:
    """Reads the guide: ``next_label`` is the next thing to click."""

    def __init__(self):
        self._labels = re.findall(r"\*\*(.+?)\*\*", GUIDE.read_text(encoding="utf-8"))

    def next_label(self, expected: str) -> str:
        label = self._labels.pop(0)
        assert label == expected, f"the guide says '{label}' where this test knows '{expected}'"
        return label

    def is_done(self) -> bool:
        return not self._labels


@in_blender(backends=("opengl",), timeout=1500.0, nightly_cases=[0])
def test_the_guide_word_by_word(person, _case):
    guide = Reader()
    yield from something_to_look_at(person, guide)
    yield from bake(person, guide)
    yield from look(person, guide)
    yield from move_a_light(person, guide)
    yield from take_it_along(person, guide)
    yield from your_own_scene(person, guide)
    assert guide.is_done()


def something_to_look_at(person, guide):
    yield from person.click_text(guide.next_label("Add"), person.rectangle(person.region("HEADER")))
    yield from person.click_text(guide.next_label("Gridlight Gallery"), person.rectangle())
    yield 2.0
    scene = person.window.scene
    assert scene.name == "Gridlight Gallery" and sum(item.type == "LIGHT" for item in scene.objects) == 3
    for word in ("Volume", "Bake", "11", "4", "7", "Spacing"):
        assert person.find(word, sidebar(person)), word
    grid = bpy.data.objects["Gallery Volume"].gridlight_grid
    assert tuple(grid.resolution) == (11, 4, 7) and abs(grid.spacing - 2.0) < 0.3
    person.picture("gallery")
    for shown in (False, True):  # closed and opened again
        yield from person.key("n")
        assert person.area().spaces.active.show_region_ui == shown
    yield 0.5


def bake(person, guide):
    operators = person.module("operators.bake")
    yield from person.click_text(guide.next_label("Bake"), (yield from person.below("path tracing")))
    yield from person.wait_until(lambda: operators.running_task() is None, "the bake", 200)
    counts = person.module("scene.field_storage").stored_counts(bpy.data.objects["Gallery Volume"])
    assert counts["total"] == 308 and counts["active"] > 250 and counts["culled"] > 0
    yield 1.5
    for word in ("active", "culled", "invalid"):
        assert person.find(word, sidebar(person)), word
    assert person.find("up to date", sidebar(person))
    person.picture("baked")


def look(person, guide):
    before = person.look(person.rectangle()).astype(float)
    yield from person.click_text(guide.next_label("Preview"), (yield from person.below("Preview")))
    preview = person.window.scene.gridlight.preview
    assert preview.enabled and preview.live
    yield from lit_room.drawn(person, 120)
    full = person.look(person.rectangle()).astype(float)
    assert left_half(np.abs(full - before)).mean() > 5
    person.picture("preview")
    views = person.module("viewport.view_images")
    finished, views.SAMPLES = views.SAMPLES, 2  # what follows is no picture of the guide
    yield from person.scroll(6)
    yield from choose(person, "Full", "Indirect")
    assert preview.mode == "INDIRECT"
    yield from lit_room.drawn(person, 120)
    assert left_half(np.abs(person.look(person.rectangle()) - full)).mean() > 5
    preview.mode = "FULL"
    yield from person.scroll(6)
    place = yield from person.below("Curve")
    place = person.find("Probe Spheres", place)
    yield from person.click(place.x - CHECKBOX_PIXELS, place.center[1])
    assert preview.show_probes
    yield from lit_room.drawn(person, 120)
    assert left_half(np.abs(person.look(person.rectangle()) - full)).mean() > 1
    preview.show_probes = False
    yield from person.scroll(-30)
    views.SAMPLES = finished
    yield from lit_room.drawn(person, 120)


def move_a_light(person, guide):
    from bpy_extras import view3d_utils
    from mathutils import Vector

    scene, operators = person.window.scene, person.module("operators.bake")
    shown = person.look(person.rectangle()).astype(float)
    lamp = scene.objects["Room ceiling light"]
    region, region_3d = person.region(), person.area().spaces.active.region_3d
    long_side = lamp.matrix_world @ Vector((0.0, 0.5 * lamp.data.size_y, 0.0))
    place = view3d_utils.location_3d_to_region_2d(region, region_3d, long_side)
    view = person.rectangle()
    yield from person.click(int(view.x + place.x), int(view.y + view.height - place.y))
    assert person.window.view_layer.objects.active == lamp and lamp.select_get()
    stood = lamp.location.copy()
    yield from person.key("g")
    x, y = view.center
    for step in range(1, 7):
        person.move(x - 20 * step, y + 5 * step)
        yield 0.1
    yield from person.click(x - 120, y + 30)
    assert (lamp.location - stood).length > 0.1
    yield from lit_room.drawn(person, 120)
    assert left_half(np.abs(person.look(view) - shown)).mean() > 0.5
    person.picture("moved")
    yield from person.click_text(guide.next_label("Relight"), (yield from person.below("path tracing")))
    yield from person.wait_until(lambda: operators.running_task() is None, "the relight", 120)
    yield 1.0
    if not person.find(
        "up to date", sidebar(person)
    ):  # reading the scene took long, and the panel asks before it does so
        person.do("gridlight.check_bake")
        yield 1.0
    assert person.find("up to date", sidebar(person))
    wandering = scene.objects["Wandering lamp"]
    began = wandering.matrix_world.translation.copy()
    yield from person.key("space")
    yield from person.wait_until(
        lambda: (wandering.matrix_world.translation - began).length > 0.1, "a lamp that wanders", 60
    )
    yield from person.key("space")
    scene.gridlight.preview.enabled = False


def take_it_along(person, guide):
    export = person.window.scene.gridlight.export
    folder = Path(bpy.app.tempdir) / "guide"
    export.directory = str(folder)
    yield from person.scroll(30)
    yield from choose(person, "Probe File", "Godot", beside=("three.js", "Unity", "Bevy"))
    assert export.target == "godot"
    yield from person.click_text(guide.next_label("Export"), (yield from person.below("Folder")))
    yield from person.wait_until(lambda: folder.exists() and any(folder.iterdir()), "the files")
    export.target = "exr"
    person.do("gridlight.export")
    assert (folder / "probes.exr").stat().st_size > 10_000


def your_own_scene(person, guide):
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 0.5
    yield from person.click_text(guide.next_label("Add"), person.rectangle(person.region("HEADER")))
    yield from person.click_text(guide.next_label("Light Probe"), person.rectangle())
    yield from person.click_text(guide.next_label("Gridlight Volume"), person.rectangle())
    yield 0.5
    volume = next(item for item in bpy.context.scene.objects if item.get("gridlight_volume"))
    assert 1000 <= np.prod(volume.gridlight_grid.resolution) <= 3000
    yield from person.open_tab()
    box = volume.matrix_world.copy()
    volume.location.x += 1.0
    assert person.find("To Selection", sidebar(person)) and person.find("Spacing", sidebar(person))
    yield from person.click_text("Fit to Scene")
    assert np.allclose(volume.matrix_world, box, atol=1e-4)


def choose(person, now, then, beside=()):
    """Opens the menu of the sidebar that shows ``now`` and clicks ``then``; it also lists what is ``beside``."""
    menu = person.find(now, sidebar(person))
    yield from person.click(*menu.center)
    view = person.rectangle()
    column = Rectangle(menu.x - MENU_PIXELS // 4, view.y, MENU_PIXELS, view.height)  # labels stand to its left
    for item in beside:
        assert person.find(item, column), item
    yield from person.click_text(then, column)


def sidebar(person):
    return person.rectangle(person.region("UI"))


def left_half(picture):
    """Of the viewport, which no panel covers."""
    return picture[:, : picture.shape[1] // 2]
