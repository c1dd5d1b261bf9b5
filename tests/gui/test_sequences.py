# SPDX-License-Identifier: GPL-3.0-or-later
"""Random sequences of what users do, seeded: nothing raises, nothing is left running, nobody's data changes unasked."""

import gc
import random

import bpy
import numpy as np
from harness import in_blender

STEPS = 14
IN_CI, NIGHTLY = range(4), range(4, 200)


@in_blender(backends=("opengl",), timeout=180, cases=IN_CI, nightly_cases=NIGHTLY)
def test_random_sequence(person, seed):
    user = User(person, seed)
    yield from user.start()
    for _ in range(STEPS):
        yield from user.step()
    yield from user.finish()


class User:
    """Does random things. ``said`` lists them, so that a failure can be read."""

    def __init__(self, person, seed: int):
        self.person = person
        self.random = random.Random(seed)
        self.said = []
        self.bake = person.module("operators.bake")
        # Those of Gridlight's own operations that must not touch anything of the user's.
        self.harmless = [
            self.start_bake,
            self.start_bake,
            self.start_relight,
            self.cancel_bake,
            self.wait_for_bake,
            self.place,
            self.reset,
            self.clear_probes,
            self.clear_bake,
            self.preview,
            self.export,
            self.check,
            self.save,
        ]
        self.other = [
            self.add_mesh,
            self.add_light,
            self.add_volume,
            self.fit_volume,
            self.delete,
            self.delete_probe,
            self.move_probe,
            self.undo,
            self.redo,
            self.reload,
            self.edit_mode,
            self.rename_volume,
            self.duplicate_volume,
            self.quality,
        ]

    def start(self):
        cube = bpy.data.objects["Cube"]
        cube.scale = (3, 3, 3)
        self.person.window.view_layer.update()
        self.do("gridlight.add_volume")
        self.shrink()
        yield 0.1

    def step(self):
        # Undo may take back Gridlight's own steps but never leaves others changed; the rest is asked for.
        act = self.random.choice(self.harmless + self.other)
        self.said.append(act.__name__)
        before = user_data()
        try:
            yield from act()
        except Exception as error:
            raise AssertionError(f"after {self.said}") from error
        if act in self.harmless:
            after = user_data()
            assert after == before, (self.said, before, after)
        yield 0.05

    def finish(self):
        self.bake.stop_running("the sequence is over")
        if bpy.context.mode != "OBJECT":
            self.do("object.mode_set", mode="OBJECT")
        for scene in bpy.data.scenes:
            scene.gridlight.preview.enabled = False
        self.person.move(*self.person.rectangle().center)  # an operator ends with the next event
        yield 0.2
        self.person.move(3, 3)
        yield 0.2
        try:
            yield from self.person.check_nothing_runs()  # before loading a file, which would end much of what is left
        except AssertionError as error:
            raise AssertionError(f"after {self.said}") from error
        bpy.ops.wm.read_homefile(use_factory_startup=True)  # the last bake stays until then
        yield 0.2
        gc.collect()
        left = [type(item).__name__ for item in gc.get_objects() if type(item).__name__ in HOLDS_GPU_MEMORY]
        assert not left, (self.said, left)

    # Helpers
    # ------------------------------------------------------------------------------------------------------------------

    def do(self, operator, **options):
        """Where the operator cannot run, a person could not press its button."""
        module, name = operator.split(".")
        with self.person.at_viewport():
            if getattr(getattr(bpy.ops, module), name).poll():
                return self.person.do(operator, **options)
        return {"CANCELLED"}

    def volumes(self):
        return [item for item in bpy.context.scene.objects if item.get("gridlight_volume")]

    def probes(self):
        return [item for item in bpy.context.scene.objects if "gridlight_probe_index" in item]

    def shrink(self):
        """Few probes: the point is not how long bakes take."""
        for volume in self.volumes():
            volume.gridlight_grid.resolution = (4, 4, 4)
        bpy.context.scene.gridlight.face = 8

    def user_objects(self):
        return [item for item in bpy.context.scene.objects if is_users(item)]

    # Gridlight's
    # ------------------------------------------------------------------------------------------------------------------

    def start_bake(self):
        with self.person.at_viewport():
            if bpy.ops.gridlight.bake.poll():
                bpy.ops.gridlight.bake("INVOKE_DEFAULT", everything=self.random.random() < 0.5)
        yield self.random.choice([0.0, 0.05, 0.2])

    def start_relight(self):
        with self.person.at_viewport():
            if bpy.ops.gridlight.relight.poll():
                bpy.ops.gridlight.relight("INVOKE_DEFAULT")
        yield self.random.choice([0.0, 0.05, 0.2])

    def cancel_bake(self):
        if self.random.random() < 0.5:
            yield from self.person.key("Escape")
        else:
            self.do("gridlight.cancel_bake")
            yield 0.05

    def wait_for_bake(self):
        yield from self.person.wait_until(lambda: self.bake.running_task() is None, "a bake", 60)

    def place(self):
        if any(item.type == "MESH" for item in bpy.context.scene.objects):
            self.do("gridlight.place_probes")
        yield 0.05

    def reset(self):
        self.do("gridlight.reset_probes", selected=self.random.random() < 0.5)
        yield 0.05

    def clear_probes(self):
        self.do("gridlight.clear_probes")
        yield 0.05

    def clear_bake(self):
        self.do("gridlight.clear_bake")
        yield 0.05

    def preview(self):
        preview = bpy.context.scene.gridlight.preview
        preview.enabled = not preview.enabled
        yield self.random.choice([0.05, 0.5])

    def export(self):
        bpy.context.scene.gridlight.export.directory = bpy.app.tempdir + "export"
        self.do("gridlight.export")
        yield 0.05

    def check(self):
        self.do("gridlight.check_bake")
        yield 0.05

    def save(self):
        bpy.ops.wm.save_as_mainfile(filepath=bpy.app.tempdir + "sequence.blend")
        yield 0.05

    # Everybody's
    # ------------------------------------------------------------------------------------------------------------------

    def add_mesh(self):
        place = [self.random.uniform(-2, 2) for _ in range(3)]
        self.do("mesh.primitive_cube_add", size=0.5, location=place)
        yield 0.05

    def add_light(self):
        self.do("object.light_add", type=self.random.choice(["POINT", "AREA", "SPOT"]), location=(0.5, 0.2, 1.0))
        yield 0.05

    def add_volume(self):
        if any(item.type == "MESH" for item in bpy.context.scene.objects):
            self.do("gridlight.add_volume")
            self.shrink()
        yield 0.05

    def fit_volume(self):
        if any(item.type == "MESH" for item in bpy.context.scene.objects):
            self.do("gridlight.fit_volume")
            self.shrink()
        yield 0.05

    def delete(self):
        items = [*self.user_objects(), *self.volumes()]
        if items and bpy.context.mode == "OBJECT":
            self.do("object.select_all", action="DESELECT")
            self.random.choice(items).select_set(True)
            self.do("object.delete")
        yield 0.05

    def delete_probe(self):
        if self.probes():
            bpy.data.objects.remove(self.random.choice(self.probes()))
        yield 0.05

    def move_probe(self):
        if self.probes():
            self.random.choice(self.probes()).location.x += self.random.uniform(-1, 1)
        yield 0.05

    def undo(self):
        yield from self.person.key("ctrl+z")

    def redo(self):
        yield from self.person.key("ctrl+shift+z")

    def reload(self):
        bpy.ops.wm.save_as_mainfile(filepath=bpy.app.tempdir + "sequence.blend")
        bpy.ops.wm.open_mainfile(filepath=bpy.app.tempdir + "sequence.blend")
        yield 0.3

    def edit_mode(self):
        meshes = [item for item in self.user_objects() if item.type == "MESH"]
        if bpy.context.mode == "OBJECT" and meshes:
            self.person.window.view_layer.objects.active = meshes[0]
        if bpy.context.mode != "OBJECT" or meshes:
            self.do("object.editmode_toggle")
        yield 0.1

    def rename_volume(self):
        if self.volumes():
            self.random.choice(self.volumes()).name = f"Volume {self.random.randrange(100)}"
        yield 0.05

    def duplicate_volume(self):
        if self.volumes() and bpy.context.mode == "OBJECT":
            self.do("object.select_all", action="DESELECT")
            volume = self.random.choice(self.volumes())
            volume.select_set(True)
            self.person.window.view_layer.objects.active = volume
            self.do("object.duplicate")
        yield 0.05

    def quality(self):
        bpy.context.scene.gridlight.quality = self.random.choice(["DRAFT", "GOOD", "FINAL"])
        yield 0.05


HOLDS_GPU_MEMORY = {
    "GpuBackend",
    "SceneTextures",
    "Surfaces",
    "Batches",
    "BakeSession",
    "PatchLight",
    "GpuScene",
    "SceneSession",
    "FieldTextures",
    "LiveField",
}


def is_users(item):
    return not item.get("gridlight_volume") and "gridlight_probe_index" not in item


def user_data():
    """What belongs to the user, in a form that can be compared."""
    for item in bpy.data.objects:
        if item.mode == "EDIT":
            item.update_from_editmode()  # else a mesh is as old as the last one who wanted to read it
    data = {}
    for item in bpy.data.objects:
        if is_users(item):
            matrix = np.round(np.array(item.matrix_basis), 6).tolist()
            data["object", item.name] = (item.type, matrix, item.parent.name if item.parent else "", item.hide_render)
    for mesh in bpy.data.meshes:
        data["mesh", mesh.name] = (
            len(mesh.vertices),
            len(mesh.polygons),
            [material.name for material in mesh.materials],
        )
    for light in bpy.data.lights:
        data["light", light.name] = (light.type, light.energy, tuple(light.color))
    for scene in bpy.data.scenes:
        render = scene.render
        data["scene", scene.name] = (
            render.engine,
            render.resolution_x,
            render.filepath,
            scene.frame_current,
            scene.camera.name if scene.camera else "",
            scene.world.name if scene.world else "",
            scene.view_settings.view_transform,
        )
    for kind in ("materials", "worlds", "images", "cameras", "actions", "collections", "texts"):
        # Probes lie in a collection that is called like their volume, and marked.
        blocks = [block for block in getattr(bpy.data, kind) if "gridlight_probes" not in block]
        mine = [block.name for block in blocks if not block.name.startswith("Gridlight")]
        data[kind] = sorted(name for name in mine if "Render Result" not in name and "Viewer Node" not in name)
    return data
