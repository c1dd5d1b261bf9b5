# SPDX-License-Identifier: GPL-3.0-or-later
"""Somebody who has never read a manual: installs, adds the gallery, bakes, looks, exports. At most six clicks."""

from pathlib import Path

import bpy
import numpy as np
from harness import in_blender
from person import EXTENSION

MOST_CLICKS = 6


@in_blender()
def test_from_installing_to_exporting_in_six_clicks(person):
    # Installing is dropping the zip onto the window and confirming: one click. The session did it on starting, from the
    # zip that Blender built; what is left to see is that it took.
    person.clicks += 1
    assert EXTENSION in bpy.context.preferences.addons
    yield from person.click_text("Add", person.rectangle(person.region("HEADER")))
    yield from person.click_text("Gridlight Gallery", person.rectangle())
    yield 1.0
    scene = person.window.scene
    yield from person.click_text("Bake", person.below("path tracing"))
    bake = person.module("operators.bake")
    yield from person.wait_until(lambda: bake.running_task() is None, "the bake", 100)
    storage = person.module("scene.field_storage")
    assert storage.stored_counts(bpy.data.objects["Gallery Volume"])["active"] == 295
    yield 1.5
    person.picture("baked")
    before = person.look(person.rectangle()).astype(float)
    yield from person.click_text("Preview", person.below("Preview"))
    assert scene.gridlight.preview.enabled

    def looks_different():
        shown = person.look(person.rectangle()).astype(float)
        return np.abs(shown - before)[:, : shown.shape[1] // 2].mean() > 5

    yield from person.wait_until(looks_different, "the preview", 30, step=0.5)
    yield 1.0
    person.picture("preview")
    folder = Path(bpy.app.tempdir) / "export"
    scene.gridlight.export.directory = str(folder)
    yield from person.scroll(8)
    yield from person.click_text("Export", person.below("Folder"))
    yield 0.5
    assert (folder / "probes.exr").stat().st_size > 10_000
    assert person.clicks <= MOST_CLICKS
    scene.gridlight.preview.enabled = False
