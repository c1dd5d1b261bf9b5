# SPDX-License-Identifier: GPL-3.0-or-later
"""Hours of use: random sessions, one after the other, hold no more than the first, which does everything once: memory,
objects of Python, objects of the GPU.

``scripts/soak`` runs it; GRIDLIGHT_SOAK_MINUTES says how long. What was measured goes to soak.csv beside the pictures.
"""

import gc
import importlib.util
import itertools
import os
import time
from pathlib import Path

import bpy
import lit_room
from harness import in_blender
from test_sequences import User

MINUTES = float(os.environ.get("GRIDLIGHT_SOAK_MINUTES", "6"))
STEPS = 25  # of a session
GROWTH = 1.05
LOOKS = 5  # at memory, of which the least counts


@in_blender(backends=("opengl",), timeout=60 * MINUTES + 600, nightly_cases=[0])
def test_hours_of_use_hold_no_more_than_the_first_session(person, seed):
    person.module("viewport.view_images").SAMPLES = 1  # pictures are not looked at
    rows, programs = [], set()
    started = time.monotonic()
    while time.monotonic() - started < 60 * MINUTES or len(rows) < 3:
        user = BusyUser(person, seed)
        yield from user.start()
        if not rows:  # whatever is made once and kept, like shaders, is made in the first session
            yield from user.see_everything()
        for _ in range(STEPS):
            yield from user.step()
        yield from user.finish()
        seed += 1
        write_programs(person, seed, programs)
        rows.append((yield from measured(seed, time.monotonic() - started)))
        write(rows)
    first, last = rows[0], rows[-1]
    for what in ("MiB", "textures", "buffers", "programs", "objects"):
        assert last[what] <= GROWTH * first[what], (what, first, last)


class BusyUser(User):
    """Also moves lamps while the preview follows, and loads other files."""

    def __init__(self, person, seed):
        super().__init__(person, seed)
        self.other += [self.move_lights, self.move_lights, self.live, self.new_file]

    def kinds(self):
        """Everything that can be done, once each; undo last, for there must be something to undo."""
        acts = {act.__name__: act for act in [*self.other, *self.harmless]}
        return [*(act for name, act in acts.items() if name not in ("undo", "redo")), self.undo, self.redo]

    def see_everything(self):
        """Whatever is compiled once has been after it: every quality, with and without gloss, few triangles and more,
        no lamp and several, one volume and three, and every kind of action. And the largest scene, two thousand probes
        baked and placed: allocators keep some of what was needed once, such as 40 MiB of a thousand Empties that are
        gone, Blender's own as well, but not twice."""
        for is_glossy, meshes in itertools.product((True, False), (0, 2)):
            yield from self.new_file()
            if not is_glossy:  # Blender's own cube is
                bpy.data.objects["Cube"].data.materials.clear()
            for _ in range(meshes):
                yield from self.add_mesh()
            for quality in ("FINAL", "GOOD", "DRAFT"):
                yield from self.bake_at(quality)
            for _ in range(2):
                yield from self.see_light()
                yield from self.add_volume()
                yield from self.bake_at("DRAFT")
            yield from self.see_light()
        yield from self.new_file()
        for _ in range(2):
            self.do("gridlight.add_volume")
            yield from self.place()
        yield from self.bake_at("DRAFT")
        yield from self.new_file()
        for lamps in (0, 3, 1):
            yield from self.have_lamps(lamps)
            yield from self.bake_at("DRAFT")
        yield from self.see_light_follow()
        for act in self.kinds():
            yield from self.wait_for_bake()
            self.said.append(act.__name__)
            yield from act()
            yield 0.05

    def bake_at(self, quality):
        bpy.context.scene.gridlight.quality = quality
        yield from self.start_bake()
        yield from self.wait_for_bake()

    def see_light(self):
        """The preview is on until its picture is finished."""
        yield from self.live()
        yield from lit_room.drawn(self.person, 120)

    def see_light_follow(self):
        """Lamps move until the light of the preview has come after them."""
        yield from self.see_light()
        yield from self.move_lights()
        session = self.person.module("viewport.sessions").existing()[0]
        yield from self.person.wait_until(
            lambda: not (session.is_relighting or session.is_pending), "light that follows", 120
        )

    def have_lamps(self, count):
        for item in [item for item in bpy.context.scene.objects if item.type == "LIGHT"]:
            bpy.data.objects.remove(item)
        for _ in range(count):
            yield from self.add_light()
        yield 0.05

    def place(self):
        if self.volumes():  # they may have been deleted, and placing says so
            yield from super().place()

    def move_lights(self):
        lamps = [item for item in bpy.context.scene.objects if item.type == "LIGHT"]
        for _ in range(5):
            for lamp in lamps:
                lamp.location.x += self.random.uniform(-0.1, 0.1)
            yield 0.1

    def live(self):
        preview = bpy.context.scene.gridlight.preview
        preview.enabled = preview.live = True
        yield 1.0

    def new_file(self):
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        yield 0.3
        yield from self.start()


def measured(sessions, seconds):
    """What is held now. Windows are drawn a few times before: some of what has been freed goes with the next frames."""
    path = Path(__file__).parents[1] / "process_size.py"
    spec = importlib.util.spec_from_file_location("process_size", path)
    process_size = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(process_size)
    readings = []
    for _ in range(LOOKS):
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                area.tag_redraw()
        yield 0.3
        readings.append(process_size.resident_mib())
    counts = {**process_size.gpu_objects(), "objects": len(gc.get_objects())}
    return {"sessions": sessions, "seconds": round(seconds), "MiB": round(min(readings), 1), **counts}


def write(rows):
    lines = [",".join(rows[0]), *(",".join(map(str, row.values())) for row in rows)]
    Path(os.environ["GRIDLIGHT_PICTURES"], "soak.csv").write_text("\n".join(lines) + "\n")


def write_programs(person, sessions, known):
    """Which programs were compiled for the first time since the last call: after the first session, none should be."""
    new = {str(key) for key in person.module("gpu_shaders.programs")._programs} - known
    with Path(os.environ["GRIDLIGHT_PICTURES"], "soak_programs.txt").open("a" if known else "w") as file:
        file.writelines(f"{sessions} {key}\n" for key in sorted(new))
    known |= new
