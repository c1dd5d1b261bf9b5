# SPDX-License-Identifier: GPL-3.0-or-later
"""The pictures of ``docs/settings.md``: what goes wrong with unsuitable settings, and the remedy.

``"$(./gridlight --environment)" scripts/manual_pictures.py [FOLDER]`` writes ``settings_*.jpg`` (default: docs/images)
and prints the figures that the text quotes. About a minute and a half on two cores with a software driver.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
WIDTH, HEIGHT = 480, 300
SAMPLES = 8
GAP = 8  # pixels between pictures
POINTS = 600


def load_package() -> None:
    path = ROOT / "cli" / "__main__.py"
    spec = importlib.util.spec_from_file_location("start", path)
    start = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(start)
    start.load_package()


load_package()

from gridlight.bake.bake_job import BakeJob  # noqa: E402
from gridlight.bake.job import run_bake  # noqa: E402  (the package has just been loaded)
from gridlight.bake.result import Silent  # noqa: E402
from gridlight.core import camera, lookup, ringing  # noqa: E402
from gridlight.core.display import standard_view  # noqa: E402
from gridlight.core.field import Field  # noqa: E402
from gridlight.core.grid import Grid  # noqa: E402
from gridlight.core.settings import BakeSettings  # noqa: E402
from gridlight.core.snapshot import SceneSnapshot  # noqa: E402
from gridlight.gpu_shaders.context import ensure_context  # noqa: E402
from gridlight.gpu_shaders.preview_pass import PreviewPass  # noqa: E402
from gridlight.gpu_shaders.scene_textures import SceneTextures  # noqa: E402
from gridlight.scene.read import read_scene  # noqa: E402

# Scenes
# ----------------------------------------------------------------------------------------------------------------------


def fresh_scene() -> None:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def block(low, high, color=(0.75, 0.75, 0.75), glow: float = 0.0) -> None:
    """A box between two corners."""
    low, high = np.array(low, float), np.array(high, float)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(low + high) / 2)
    item = bpy.context.object
    item.scale = high - low
    material = bpy.data.materials.new("Block")
    material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (*color, 1)
    shader.inputs["Emission Color"].default_value = (*color, 1)
    shader.inputs["Emission Strength"].default_value = glow
    item.data.materials.append(material)


def walls(low, high, thickness=0.2, skip=()) -> None:
    """A room between two corners, walls outside of it; ``skip``: sides left open, as (axis, 0 or 1)."""
    low, high = np.array(low, float), np.array(high, float)
    for axis in range(3):
        for side in (0, 1):
            if (axis, side) not in skip:
                start, stop = low - thickness, high + thickness
                start[axis], stop[axis] = (high[axis], stop[axis]) if side else (start[axis], low[axis])
                block(start, stop)


def lamp(kind: str, power: float, at, **properties) -> bpy.types.Object:
    bpy.ops.object.light_add(type=kind, location=at)
    light = bpy.context.object
    light.data.energy = power
    for name, value in properties.items():
        setattr(light.data, name, value)
    return light


def snapshot() -> SceneSnapshot:
    bpy.context.view_layer.update()
    return read_scene(bpy.context.scene, bpy.context.view_layer)


# Bakes and pictures
# ----------------------------------------------------------------------------------------------------------------------


def bake(scene: SceneSnapshot, low, high, resolution, **settings) -> Field:
    grid = Grid.from_bounds(low, high, resolution)
    return run_bake(BakeJob(scene, grid, BakeSettings(**settings)), Silent(), lambda: False).field


def straight(field: Field) -> Field:
    """``field`` as engines interpolate it: no gradients, and nothing ever stands between a point and a probe."""
    plain = Field(field.grid, field.coefficients, field.state, field.validity, field.offset, np.zeros_like(field.depth))
    plain.depth[..., :2] = 1e3, 1e6  # far and flat, and nothing of planes
    return plain


def picture(scene: SceneSnapshot, field: Field, view: camera.Camera, stops: float) -> np.ndarray:
    """(HEIGHT, WIDTH, 3) display values, row 0 at the bottom."""
    origin = field.grid.center
    textures = SceneTextures(scene, origin, np.zeros(len(scene.triangles)))
    passes = PreviewPass(scene, textures, field, origin)
    plain, _ = passes.render(view, WIDTH, HEIGHT, SAMPLES)
    return standard_view(plain[..., :3], stops)


def save(name: str, pictures: list[np.ndarray], folder: Path) -> None:
    """The pictures side by side as a JPEG."""
    gap = np.ones((HEIGHT, GAP, 3))
    row = [part for shown in pictures for part in (gap, shown)][1:]
    values = np.concatenate(row, axis=1)
    image = bpy.data.images.new(name, values.shape[1], values.shape[0])
    pixels = np.ones((*values.shape[:2], 4), np.float32)
    pixels[..., :3] = values
    image.pixels.foreach_set(pixels.ravel())
    image.filepath_raw = str(folder / f"settings_{name}.jpg")
    image.file_format = "JPEG"
    image.save()
    bpy.data.images.remove(image)


def difference(field: Field, truth: Field, low, high) -> float:
    """Relative RMS in percent of irradiance at random places between two corners."""
    generator = np.random.default_rng(1)
    points = generator.uniform(low, high, (POINTS, 3))
    normals = generator.normal(size=(POINTS, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    exact = lookup.irradiance(truth, points, normals)
    error = lookup.irradiance(field, points, normals) - exact
    return 100 * float(np.sqrt((error**2).mean() / (exact**2).mean()))


# The three figures
# ----------------------------------------------------------------------------------------------------------------------


def too_few_probes(folder: Path) -> None:
    fresh_scene()
    low, high = np.array([-3.0, -2.0, 0.0]), np.array([3.0, 2.0, 3.0])
    walls(low, high)
    block((-0.2, 1.0, 0), (0.2, 2.0, 3.0))
    block((-2.99, -2.0, 0.0), (-2.9, 2.0, 3.0), (0.7, 0.1, 0.08))
    block((1.2, 0.8, 0.0), (2.2, 1.8, 1.1), (0.15, 0.3, 0.7))
    lamp("SPOT", 900, (-1.4, -0.4, 2.8), spot_size=0.9, spot_blend=0.4, shadow_soft_size=0.05)
    scene = snapshot()
    view = camera.look((2.6, -1.8, 1.9), (-1.6, 1.0, 0.9), WIDTH / HEIGHT, 0.75)
    inset = 0.15
    truth = bake(scene, low + inset, high - inset, (25, 17, 13))
    shown = []
    for counts in ((2, 2, 2), (4, 3, 3), (9, 7, 5)):
        field = bake(scene, low + inset, high - inset, counts)
        print("few probes", counts, f"{difference(field, truth, low + inset, high - inset):.1f} %")
        shown.append(picture(scene, field, view, 0.5))
    save("few_probes", [shown[0], shown[2]], folder)


def leaks(folder: Path) -> None:
    fresh_scene()
    low, high = np.array([-3.0, -2.0, 0.0]), np.array([3.0, 2.0, 2.6])
    walls(low, high)
    block((-0.05, -2.0, 0.0), (0.05, 2.0, 2.6))
    block((-2.2, 0.6, 0.0), (-1.4, 1.4, 0.9), (0.6, 0.45, 0.3))
    lamp("POINT", 300, (1.6, 0.0, 2.0), shadow_soft_size=0.1)
    lamp("POINT", 15, (-2.5, -1.5, 2.2), shadow_soft_size=0.1)
    scene = snapshot()
    view = camera.look((-2.8, -1.7, 1.5), (-0.4, 0.9, 1.0), WIDTH / HEIGHT, 0.75)
    inside = (-2.8, -1.8, 0.2), (-0.1, 1.8, 2.4)
    truth = bake(scene, *inside, (12, 13, 9))
    box = (-2.8, -1.8, 0.2), (2.8, 1.8, 2.4)
    in_the_wall, beside_it = bake(scene, *box, (5, 4, 3)), bake(scene, *box, (6, 4, 3))
    own = bake(scene, (-2.8, -1.8, 0.2), (-0.25, 1.8, 2.4), (3, 4, 3))
    for name, field in (
        ("engine, one volume", straight(beside_it)),
        ("Gridlight, one volume", beside_it),
        ("Gridlight, probes within the wall", in_the_wall),
        ("engine, a volume of its own", straight(own)),
        ("Gridlight, a volume of its own", own),
    ):
        print("leaks", name, f"{difference(field, truth, *inside):.0f} %")
    save("leaks", [picture(scene, field, view, 1.0) for field in (straight(beside_it), beside_it, own)], folder)


def rings(folder: Path) -> None:
    fresh_scene()
    low, high = np.array([-2.0, -2.0, 0.0]), np.array([2.0, 2.0, 2.6])
    walls(low, high)
    block((0.2, -0.4, 0.0), (1.0, 0.4, 1.2), (0.8, 0.8, 0.8))
    block((-1.99, -0.5, 1.0), (-1.95, 0.5, 1.8), (1.0, 0.9, 0.7), glow=30.0)
    for item in bpy.data.objects:
        for slot in item.material_slots:
            shader = next(node for node in slot.material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
            if shader.inputs["Emission Strength"].default_value == 0:
                shader.inputs["Base Color"].default_value = (0.12, 0.12, 0.12, 1)
    scene = snapshot()
    view = camera.look((1.8, -1.8, 1.8), (0.3, 0.2, 0.6), WIDTH / HEIGHT, 0.7)
    shown = []
    for deringing in (False, True):
        field = bake(scene, (-1.8, -1.8, 0.2), (1.8, 1.8, 2.4), (5, 5, 4), deringing=deringing)
        print("ringing", deringing, ringing.ringing(field.coefficients[field.state == 1]).as_dict())
        shown.append(picture(scene, field, view, 3.0))
    save("ringing", shown, folder)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "images"
    ensure_context()
    for figure in (too_few_probes, leaks, rings):
        figure(target)
