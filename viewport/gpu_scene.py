# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene and the light of its volumes on the GPU, ready to be drawn: what the viewport and final renders share."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.field import Field
from ..core.snapshot import Light, SceneSnapshot, World
from ..gpu_shaders.scene_textures import SceneTextures
from ..gpu_shaders.viewport_field import FieldTextures
from ..gpu_shaders.viewport_pass import MOST_VOLUMES, ViewportPass
from ..scene.field_storage import load_field
from ..scene.volumes import find_volumes


class GpuScene:
    """``drawing`` draws it; ``fields`` are the baked volumes by name."""

    def __init__(self, scene: bpy.types.Scene, snapshot: SceneSnapshot):
        """``snapshot`` must have triangles. Positions are relative to the first volume's middle, so that a scene far
        from the world's origin is drawn as well as one there."""
        volumes = find_volumes(scene)
        low, high = snapshot.bounds()
        self.origin = np.asarray(volumes[0].matrix)[:3, 3] if volumes else (low + high) / 2
        self._textures = SceneTextures(snapshot, self.origin, np.zeros(len(snapshot.triangles)))
        self.drawing = ViewportPass(self._textures, self.origin, len(snapshot.object_names), snapshot.world)
        self.fields: dict[str, FieldTextures] = {}
        self.load_fields(scene)

    def load_fields(self, scene: bpy.types.Scene) -> None:
        """Takes the light that the volumes of ``scene`` hold now.

        Raises:
            InputError: stored light cannot be read.
        """
        self.fields = {}
        for volume in find_volumes(scene)[:MOST_VOLUMES]:
            field = load_field(scene.objects[volume.name])
            if field is not None:
                self.fields[volume.name] = FieldTextures(field, self.origin)
        self.drawing.set_fields(list(self.fields.values()))

    def show_fields(self, fields: dict[str, Field], with_old_light: bool = False) -> None:
        """Shows ``fields`` instead of those of the volumes of these names; ``with_old_light`` in the light that is
        shown now, where it has the same form."""
        for name, field in fields.items():
            shown = FieldTextures(field, self.origin)
            if with_old_light and name in self.fields:
                shown.take_light_of(self.fields[name])
            self.fields[name] = shown
        self.drawing.set_fields(list(self.fields.values()))

    def set_lights(self, lights: list[Light]) -> None:
        self._textures.set_lights(lights, self.origin)

    def set_world(self, world: World) -> None:
        self.drawing.set_world(world)
