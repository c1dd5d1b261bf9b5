# SPDX-License-Identifier: GPL-3.0-or-later
"""``docs/getting_started.md`` word by word: whatever stands there in bold is found on the screen and clicked, in its
order. The pictures of the guide are those that this test takes.
"""

import re
from pathlib import Path

import bpy
import numpy as np
from harness import in_blender

GUIDE = Path(__file__).parents[2] / "docs" / "getting_started.md"


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


@in_blender(backends=("opengl",), timeout=900.0, nightly_cases=[0])
def test_the_guide_word_by_word(person, _case):
    guide = Reader()
    # 2. Something to look at
    yield from person.click_text(guide.next_label("Add"), person.rectangle(person.region("HEADER")))
    yield from person.click_text(guide.next_label("Gridlight Gallery"), person.rectangle())
    yield 2.0
    scene = person.window.scene
    sidebar = person.rectangle(person.region("UI"))
    assert person.find("Volume", sidebar) and person.find("Bake", sidebar)
    person.picture("gallery")
    # 3. Bake
    bake = person.module("operators.bake")
    yield from person.click_text(guide.next_label("Bake"), (yield from person.below("path tracing")))
    yield from person.wait_until(lambda: bake.running_task() is None, "the bake", 200)
    counts = person.module("scene.field_storage").stored_counts(bpy.data.objects["Gallery Volume"])
    assert counts["active"] > 250 and counts["culled"] > 0
    yield 1.5
    for word in ("active", "culled", "invalid"):
        assert person.find(word, sidebar), word
    assert person.find("up to date", sidebar)
    person.picture("baked")
    # 4. Look
    before = person.look(person.rectangle()).astype(float)
    yield from person.click_text(guide.next_label("Preview"), (yield from person.below("Preview")))
    assert scene.gridlight.preview.enabled and scene.gridlight.preview.live
    views = person.module("viewport.handlers")
    sessions = person.module("viewport.sessions")

    def is_drawn():
        session = next(iter(sessions.existing()), None)
        if session is None or session.gpu is None or session.is_pending:
            return False
        return not any(views.images.needs_drawing(area) for area, _ in views._views())

    yield from person.wait_until(is_drawn, "the preview", 120, step=0.5)
    shown = person.look(person.rectangle()).astype(float)
    assert np.abs(shown - before)[:, : shown.shape[1] // 2].mean() > 5
    person.picture("preview")
    # 5. Move a light
    lamp = scene.objects["Room ceiling light"]
    for item in scene.objects:
        item.select_set(item == lamp)
    person.window.view_layer.objects.active = lamp
    stood = lamp.location.copy()
    yield from person.key("g")
    x, y = person.rectangle().center
    for step in range(1, 7):
        person.move(x - 20 * step, y + 5 * step)
        yield 0.1
    yield from person.click(x - 120, y + 30)
    assert (lamp.location - stood).length > 0.1
    yield from person.wait_until(is_drawn, "light that follows", 120, step=0.5)
    after = person.look(person.rectangle()).astype(float)
    assert np.abs(after - shown)[:, : shown.shape[1] // 2].mean() > 0.5
    person.picture("moved")
    yield from person.click_text(guide.next_label("Relight"), (yield from person.below("path tracing")))
    yield from person.wait_until(lambda: bake.running_task() is None, "the relight", 120)
    yield 1.0
    if not person.find("up to date", sidebar):  # reading the scene took long, and the panel asks before it does so
        person.do("gridlight.check_bake")
        yield 1.0
    assert person.find("up to date", sidebar)
    scene.gridlight.preview.enabled = False
    # 6. Take it along
    folder = Path(bpy.app.tempdir) / "guide"
    scene.gridlight.export.directory = str(folder)
    yield from person.scroll(10)
    yield from person.click_text(guide.next_label("Export"), (yield from person.below("Folder")))
    yield 1.0
    assert (folder / "probes.exr").stat().st_size > 10_000
    # 7. Your own scene
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield 0.5
    yield from person.click_text(guide.next_label("Add"), person.rectangle(person.region("HEADER")))
    yield from person.click_text(guide.next_label("Light Probe"), person.rectangle())
    yield from person.click_text(guide.next_label("Gridlight Volume"), person.rectangle())
    yield 0.5
    assert any(item.get("gridlight_volume") for item in bpy.context.scene.objects)
    assert guide.is_done()
