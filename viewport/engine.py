# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine "Gridlight": the preview's picture in scene-linear light, under Blender's own colour management."""

from __future__ import annotations

import time

import bpy
import gpu
import numpy as np

from ..core.errors import GridlightError, InputError
from ..core.snapshot import World
from ..core.view import View
from ..gpu_shaders.viewport_pass import Picture, display
from ..gpu_shaders.viewport_shading import Shading
from ..scene.notices import Notices
from ..scene.read import read_evaluated
from ..scene.world import needs_render, read_world
from . import handlers
from .gpu_scene import GpuScene

_FINAL_SAMPLES = 32  # per pixel of a rendered image
# Panels of other engines that also belong to this one: what they set is what the bake reads.
_PANELS = (
    "DATA_PT_EEVEE_light",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
)
_UNFIT = {"RENDER_PT_simplify", "VIEWLAYER_PT_filter", "RENDER_PT_freestyle"}


class GRIDLIGHT_RE_engine(bpy.types.RenderEngine):
    """Direct light and baked light, drawn as the preview draws them"""

    bl_idname = handlers.ENGINE
    bl_label = "Gridlight"
    bl_use_preview = False
    bl_use_gpu_context = True
    bl_use_eevee_viewport = True  # material preview

    def view_update(self, context, depsgraph):
        """Blender tells of changes; the application handlers have noticed them already."""
        handlers.request(context.scene)

    def view_draw(self, context, depsgraph):
        session = handlers.request(context.scene)
        if session.gpu is None:
            self.update_stats("Gridlight", session.message or "Reading the scene")
            return
        shading = Shading(highlight=context.scene.gridlight.preview.highlight)
        started = time.perf_counter()
        picture, _ = handlers.images.draw(context, session, shading, None)
        session.readout.frame(time.perf_counter() - started)
        gpu.state.depth_test_set("ALWAYS")
        gpu.state.depth_mask_set(True)
        gpu.state.blend_set("ALPHA_PREMULT")
        display(picture, "SCENE_LINEAR")
        gpu.state.depth_test_set("NONE")
        gpu.state.depth_mask_set(False)
        gpu.state.blend_set("NONE")
        self.update_stats("Gridlight", session.message)

    def render(self, depsgraph):  # type: ignore[override]
        try:
            self._render(depsgraph)
        except GridlightError as error:
            self.report({"ERROR"}, str(error))

    def _render(self, depsgraph) -> None:
        scene = depsgraph.scene
        width, height = resolution(scene.render)
        snapshot = read_evaluated(depsgraph, self._world(scene))
        view = self._view(depsgraph, width, height)
        pixels = np.zeros((height, width, 4), np.float32)
        if len(snapshot.triangles):
            picture = Picture(width, height)
            drawing = GpuScene(scene, snapshot).drawing
            shading = Shading(highlight=scene.gridlight.preview.highlight)
            for sample in range(_FINAL_SAMPLES):
                if self.test_break():
                    return
                drawing.draw(picture, view, shading, None)
                picture.wait()
                self.update_progress((sample + 1) / _FINAL_SAMPLES)
            pixels[:] = picture.read()
        else:
            self.report({"WARNING"}, f"scene '{scene.name}' has no surface that renders")
        left, bottom, right, top = border(scene.render, width, height)
        part = np.ascontiguousarray(pixels[bottom:top, left:right]).reshape(-1)
        result = self.begin_result(0, 0, right - left, top - bottom)
        result.layers[0].passes["Combined"].rect.foreach_set(part)
        self.end_result(result)

    def _world(self, scene: bpy.types.Scene) -> World:
        """Background of ``scene``; where only a render can tell what it is, that of the last preview, else none."""
        if not needs_render(scene):
            return read_world(scene, Notices())
        for session in handlers.sessions.existing():
            if session.scene == scene and session.snapshot is not None:
                return session.snapshot.world
        self.report(
            {"WARNING"},
            f"world '{scene.world.name}' is too complex to be read while rendering and is left out; switch the preview "
            "on once before",
        )
        return World()

    def _view(self, depsgraph, width: int, height: int) -> View:
        """Of the render's camera, with lens shift and the pixels' own aspect."""
        scene = depsgraph.scene_eval
        camera = scene.camera
        if camera is None:
            raise InputError(f"scene '{scene.name}' has no camera; add one")
        window = camera.calc_matrix_camera(
            depsgraph,
            x=width,
            y=height,
            scale_x=scene.render.pixel_aspect_x,
            scale_y=scene.render.pixel_aspect_y,
        )
        view = camera.matrix_world.normalized().inverted()
        return View.from_matrices(np.array(view), np.array(window))


def resolution(render: bpy.types.RenderSettings) -> tuple[int, int]:
    """Pixels of the whole image."""
    share = render.resolution_percentage / 100
    return max(int(render.resolution_x * share), 1), max(int(render.resolution_y * share), 1)


def border(render: bpy.types.RenderSettings, width: int, height: int) -> tuple[int, int, int, int]:
    """Left, bottom, right and top pixel of what is rendered."""
    if not render.use_border:
        return 0, 0, width, height
    left, right = int(render.border_min_x * width), int(render.border_max_x * width)
    bottom, top = int(render.border_min_y * height), int(render.border_max_y * height)
    return left, bottom, max(right, left + 1), max(top, bottom + 1)


def _panels():
    """Blender's panels that this engine shows."""
    for panel in bpy.types.Panel.__subclasses__():
        engines = getattr(panel, "COMPAT_ENGINES", None)
        if engines is None or panel.__name__ in _UNFIT:
            continue
        if "BLENDER_RENDER" in engines or panel.__name__ in _PANELS:
            yield engines


def register() -> None:
    bpy.utils.register_class(GRIDLIGHT_RE_engine)
    for engines in _panels():
        engines.add(handlers.ENGINE)


def unregister() -> None:
    for engines in _panels():
        engines.discard(handlers.ENGINE)
    bpy.utils.unregister_class(GRIDLIGHT_RE_engine)
