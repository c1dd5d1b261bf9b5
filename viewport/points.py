# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes of volumes that have too many of them for objects, as points.

The draw handler exists from the moment that some scene has such probes until a file is loaded.
"""

from __future__ import annotations

import bpy
import gpu
import numpy as np
from bpy.app.handlers import persistent
from gpu_extras.batch import batch_for_shader

from ..scene.probe_objects import placed_points

_COLOR = (1.0, 0.72, 0.25, 0.9)
_SIZE_PIXELS = 3.0

_handles: list[object] = []
_batches: dict[int, gpu.types.GPUBatch | None] = {}  # by scene; made when first drawn


def sync() -> None:
    """Starts drawing if there is something to draw, and has it looked up again."""
    _batches.clear()
    if not _handles and any(placed_points(scene) for scene in bpy.data.scenes):
        _handles.append(bpy.types.SpaceView3D.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW"))
        for handlers in _lists():
            handlers.append(_changed)


def stop() -> None:
    _batches.clear()
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")
        for handlers in _lists():
            handlers.remove(_changed)


def _lists() -> tuple[list, ...]:
    handlers = bpy.app.handlers
    return handlers.depsgraph_update_post, handlers.undo_post, handlers.redo_post


@persistent
def _changed(_scene, _depsgraph=None) -> None:
    _batches.clear()


def _draw() -> None:
    context = bpy.context
    if not context.space_data.overlay.show_overlays:
        return
    key = context.scene.session_uid
    if key not in _batches:
        _batches[key] = _batch(context.scene)
    batch = _batches[key]
    if batch is None:
        return
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    shader.uniform_float("color", _COLOR)
    before = gpu.state.depth_test_get(), gpu.state.blend_get()
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.blend_set("ALPHA")
    gpu.state.point_size_set(_SIZE_PIXELS * context.preferences.system.ui_scale)
    batch.draw(shader)
    gpu.state.point_size_set(1.0)
    gpu.state.depth_test_set(before[0])
    gpu.state.blend_set(before[1])


def _batch(scene: bpy.types.Scene) -> gpu.types.GPUBatch | None:
    places = [points for volume, points in placed_points(scene) if volume.visible_get()]
    if not places:
        return None
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    return batch_for_shader(shader, "POINTS", {"pos": np.concatenate(places).astype(np.float32)})
