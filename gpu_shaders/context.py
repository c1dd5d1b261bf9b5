# SPDX-License-Identifier: GPL-3.0-or-later
"""A GPU context, with or without a window."""

from __future__ import annotations

import bpy
import gpu

from ..core.errors import NoGpuError

_made = False


def ensure_context() -> None:
    """Makes GPU calls possible; does nothing where they are already.

    With a window there always is a context. Without one, Blender 5.2 has ``gpu.init``; before that a render by an
    engine that asks for a context leaves one behind. A machine without a working driver aborts the process here, which
    the command line's parent process turns into a plain message.

    Raises:
        NoGpuError: Blender went on without a context.
    """
    global _made
    if _made or not bpy.app.background:
        return
    if hasattr(gpu, "init"):
        try:
            gpu.init()
        except (RuntimeError, SystemError) as error:  # what the binding raises when the backend refuses
            raise NoGpuError(f"no usable GPU context: {error}; install a graphics driver with OpenGL 4.3") from error
    else:
        _render_once()
    _made = True


def _render_once() -> None:
    """Renders four pixels in a scene of their own with an engine that asks for a GPU context."""

    class ContextEngine(bpy.types.RenderEngine):
        bl_idname = "GRIDLIGHT_CONTEXT"
        bl_label = "Gridlight context"
        bl_use_gpu_context = True

        def render(self, depsgraph):  # type: ignore[override]
            """Nothing to draw: Blender made the context before it called."""

    bpy.utils.register_class(ContextEngine)
    scene = bpy.data.scenes.new("Gridlight context")
    try:
        scene.render.engine = ContextEngine.bl_idname  # type: ignore[assignment]
        scene.render.resolution_x = scene.render.resolution_y = 4
        camera = bpy.data.objects.new("Gridlight context", bpy.data.cameras.new("Gridlight context"))
        scene.collection.objects.link(camera)
        scene.camera = camera
        bpy.ops.render.render(scene=scene.name)
        data = camera.data
        bpy.data.objects.remove(camera)
        bpy.data.cameras.remove(data)  # type: ignore[arg-type]
    except RuntimeError as error:  # how bpy.ops reports a render that could not start
        raise NoGpuError(f"no usable GPU context: {error}; install a graphics driver with OpenGL 4.3") from error
    finally:
        bpy.data.scenes.remove(scene)
        bpy.utils.unregister_class(ContextEngine)


def device_description() -> str:
    """Renderer, driver version and Blender's backend in one line, for reports and caches."""
    platform = gpu.platform
    return f"{platform.renderer_get()} | {platform.version_get()} | {platform.backend_type_get()}"
