# SPDX-License-Identifier: GPL-3.0-or-later
"""Access to the evaluated scene, either as a render sees it or as the viewport does.

``evaluated_depsgraph_get()`` is a viewport depsgraph: it holds what the viewport shows, with viewport subdivision
levels and without objects that are only hidden there. A bake is judged against a render, so it reads the RENDER
depsgraph, and the only place where Blender hands that one to Python is the ``render()`` callback of a render engine.
The engine here draws nothing: a render with it on a copy of the scene costs milliseconds.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import bpy

from .temporary import nothing_to_update, quiet_stdout, scene_copy

Result = TypeVar("Result")


def at_render_quality(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, visit: Callable[[bpy.types.Depsgraph], Result]
) -> Result:
    """Call ``visit`` with the RENDER depsgraph of ``view_layer`` at the scene's frame and return what it returns.

    Nothing that belongs to the depsgraph may be kept after ``visit`` returned. What ``visit`` raises is raised here.

    Raises:
        RuntimeError: Blender could not render, for example because a render is already running.
    """
    outcome: list = []

    def render(_engine, depsgraph):
        try:
            outcome.append((visit(depsgraph), None))
        except Exception as error:  # Blender would print and drop it here; it is raised again below
            outcome.append((None, error))

    engine = type(
        "GridlightSceneReader",
        (bpy.types.RenderEngine,),
        {
            "bl_idname": "GRIDLIGHT_SCENE_READER",
            "bl_label": "Gridlight Scene Reader",
            "render": render,
        },
    )
    _leave_edit_data_current(scene)
    view_layer.update()  # what scripts changed reaches the user's own objects, whose places volumes and cameras have
    bpy.utils.register_class(engine)
    try:
        with scene_copy(scene) as copy, quiet_stdout(), nothing_to_update(copy):
            copy.render.engine = engine.bl_idname
            copy.render.resolution_x = copy.render.resolution_y = 4
            bpy.ops.render.render(scene=copy.name, layer=view_layer.name)
    finally:
        bpy.utils.unregister_class(engine)
    if not outcome:
        raise RuntimeError("Blender did not evaluate the scene for rendering")
    result, error = outcome[0]
    if error is not None:
        raise error
    return result


def as_in_viewport(
    scene: bpy.types.Scene, view_layer: bpy.types.ViewLayer, visit: Callable[[bpy.types.Depsgraph], Result]
) -> Result:
    """Call ``visit`` with the viewport's own depsgraph: nothing is evaluated twice, so it follows edits live. It knows
    what is being edited; nothing is touched that would count as another edit."""
    depsgraph = view_layer.depsgraph
    if depsgraph is None:  # this view layer is not shown in any window
        with bpy.context.temp_override(scene=scene, view_layer=view_layer):
            depsgraph = bpy.context.evaluated_depsgraph_get()
    depsgraph.update()
    return visit(depsgraph)


def rendered_objects(view_layer: bpy.types.ViewLayer) -> set[int]:
    """``session_uid`` of the objects of ``view_layer`` that neither they themselves nor all their collections keep out
    of renders.
    """
    rendered: set[int] = set()
    pending = [view_layer.layer_collection]
    while pending:
        layer = pending.pop()
        if layer.exclude or layer.collection.hide_render:
            continue
        rendered.update(item.session_uid for item in layer.collection.objects if not item.hide_render)
        pending.extend(layer.children)
    return rendered


def _leave_edit_data_current(scene: bpy.types.Scene) -> None:
    """Bring meshes that are being edited up to date; their unsaved edits live outside the datablock."""
    for item in scene.objects:
        if item.mode == "EDIT" and item.type == "MESH":
            item.update_from_editmode()
