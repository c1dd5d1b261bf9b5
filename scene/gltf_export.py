# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as a GLB, by Blender's own glTF exporter."""

from __future__ import annotations

import bpy

from ..core.errors import InputError
from .temporary import leave_nothing_behind, quiet_stdout


def export_glb(path) -> None:
    """Writes what renders in the active scene to ``path``: meshes with modifiers applied, materials, Y up.

    No lamps (glTF has no area lights; see formats/export_three_scene.py), cameras or animation.

    Raises:
        InputError: the exporter is not there, or failed; the message is its own.
    """
    if not hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):
        raise InputError("Blender's glTF exporter is switched off; enable the add-on 'glTF 2.0 format'")
    try:
        with leave_nothing_behind(), quiet_stdout():
            bpy.ops.export_scene.gltf(
                filepath=str(path),
                export_format="GLB",
                use_active_scene=True,
                use_renderable=True,
                export_apply=True,
                export_yup=True,
                export_lights=False,
                export_cameras=False,
                export_animations=False,
            )
    except RuntimeError as error:
        raise InputError(f"Blender's glTF exporter failed: {' '.join(str(error).split())}") from error
