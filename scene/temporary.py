# SPDX-License-Identifier: GPL-3.0-or-later
"""Rendering aside: work on a throw-away copy of the user's scene and leave ``bpy.data`` as it was.

Reading at render quality, sampling a world and the Cycles reference all need render settings and a camera of their own.
They get them on a copy that shares the user's objects but not the scene's settings, so nothing has to be restored by
hand.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import bpy
import numpy as np

_TRACKED = (
    "scenes",
    "objects",
    "cameras",
    "worlds",
    "images",
    "meshes",
    "materials",
    "collections",
    "node_groups",
    "lights",
    "textures",
    "actions",
)


@contextmanager
def leave_nothing_behind() -> Iterator[None]:
    """Remove every datablock that the block made, also when it fails."""
    before = {name: {block.session_uid for block in getattr(bpy.data, name)} for name in _TRACKED}
    try:
        yield
    finally:
        made = [
            block for name in _TRACKED for block in getattr(bpy.data, name) if block.session_uid not in before[name]
        ]
        bpy.data.batch_remove(made)


@contextmanager
def at_frame(scene: bpy.types.Scene, frame: int | None) -> Iterator[None]:
    """``scene`` at ``frame`` (None: where it is), and back at its own frame afterwards.

    The scene itself, as a copy is not enough: animated visibility of what collections instance follows the frame that
    was set last in the scene of a window.
    """
    own_frame, own_subframe = scene.frame_current, scene.frame_subframe
    moved = frame is not None and frame != own_frame
    if moved:
        scene.frame_set(frame)
    try:
        yield
    finally:
        if moved:
            scene.frame_set(own_frame, subframe=own_subframe)


@contextmanager
def scene_copy(scene: bpy.types.Scene, frame: int | None = None) -> Iterator[bpy.types.Scene]:
    """A copy of ``scene`` at ``frame`` (default: its current one) with a camera of its own and no post-processing.

    Objects, collections and the world are the user's own datablocks: do not write to them.
    """
    with at_frame(scene, frame), leave_nothing_behind():
        copy = scene.copy()
        plain_render_settings(copy)
        copy.camera = new_camera(copy)
        try:
            yield copy
        finally:
            # Cycles frees what it keeps of the scene now; later it would look for a scene that is gone, and crash.
            copy.render.use_persistent_data = False


def new_camera(scene: bpy.types.Scene) -> bpy.types.Object:
    """A camera in ``scene`` that nothing drives; ``leave_nothing_behind`` takes it away again."""
    camera = bpy.data.objects.new("Gridlight Camera", bpy.data.cameras.new("Gridlight Camera"))
    scene.collection.objects.link(camera)
    return camera


def plain_render_settings(scene: bpy.types.Scene) -> None:
    """Switch off everything that would change or multiply the picture after or beside the render itself."""
    render = scene.render
    render.use_compositing = False
    render.use_sequencer = False
    render.use_multiview = False
    render.use_border = False
    render.use_motion_blur = False
    render.use_freestyle = False
    render.use_file_extension = True
    render.use_overwrite = True
    render.use_placeholder = False
    render.resolution_percentage = 100
    render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    render.film_transparent = False


def render_pixels(scene: bpy.types.Scene, view_layer: str) -> np.ndarray:
    """Render ``scene`` and return its linear (height, width, 3) float32 pixels, row 0 at the bottom.

    Blender keeps a render's pixels from Python, so they travel through an uncompressed 32-bit file in a temporary
    folder.

    Raises:
        RuntimeError: Blender could not render; the message is Blender's.
    """
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # 5.x: a scene set to video offers no image formats
        settings.media_type = "IMAGE"
    settings.file_format = "OPEN_EXR"
    settings.color_mode = "RGB"
    settings.color_depth = "32"
    settings.exr_codec = "NONE"
    with tempfile.TemporaryDirectory(prefix="gridlight-") as folder:
        path = Path(folder) / "render.exr"
        scene.render.filepath = str(path)
        with quiet_stdout(), nothing_to_update(scene):
            bpy.ops.render.render(write_still=True, scene=scene.name, layer=view_layer)
        return _read_exr(path)


def _read_exr(path: Path) -> np.ndarray:
    import OpenEXR  # only here: the rest of the scene reader works without the wheel

    with OpenEXR.File(str(path)) as file:
        return np.ascontiguousarray(file.channels()["RGB"].pixels[::-1], np.float32)


@contextmanager
def nothing_to_update(scene: bpy.types.Scene) -> Iterator[None]:
    """For renders of ``scene``, a copy: operators bring the view layer of their context up to date, before and after,
    which for the user's would be built anew each time, as a scene came and went. Here it is one of an empty scene.
    Renders evaluate what they show themselves, but what is animated at the frame of the context's scene."""
    empty = bpy.data.scenes.new("Gridlight Empty")
    empty.frame_current, empty.frame_subframe = scene.frame_current, scene.frame_subframe
    try:
        with bpy.context.temp_override(scene=empty, view_layer=empty.view_layers[0]):
            yield
    finally:
        bpy.data.scenes.remove(empty)


@contextmanager
def quiet_stdout() -> Iterator[None]:
    """Drop what Blender's C code prints to standard output while rendering in the background.

    Standard output belongs to the command's result; Cycles would print a line per sample there.
    """
    if not bpy.app.background:
        yield
        return
    sys.stdout.flush()
    saved = os.dup(1)
    silent = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(silent, 1)
        yield
    finally:
        sys.stdout.flush()
        os.dup2(saved, 1)
        os.close(silent)
        os.close(saved)
