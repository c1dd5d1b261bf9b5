# SPDX-License-Identifier: GPL-3.0-or-later
"""Probe volumes: those that stand in the scene as Empties, and (from ``volume_fit``) one for a scene that has none."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

from ..core.snapshot import Volume
from .volume_fit import fit_volume, fitted_bounds

__all__ = ["create_volume", "find_volumes", "fit_volume", "fitted_bounds"]

MARK, RESOLUTION = "gridlight_volume", "gridlight_resolution"


def find_volumes(scene: bpy.types.Scene) -> list[Volume]:
    """Volumes of ``scene``, by name: box Empties marked by the custom property ``gridlight_volume``.

    The Empty's box is its display size, a cube of half edge ``empty_display_size``, through its world transform.
    Volumes may be hidden; a bake reads them all the same.
    """
    volumes = []
    for item in sorted(scene.objects, key=lambda item: item.name):
        if item.type == "EMPTY" and item.get(MARK):
            matrix = np.array(item.matrix_world, float)
            matrix[:3, :3] *= item.empty_display_size
            resolution = tuple(int(count) for count in item.get(RESOLUTION, (2, 2, 2)))
            volumes.append(Volume(item.name, matrix, resolution))
    return volumes


def create_volume(scene: bpy.types.Scene, name: str, matrix: np.ndarray, resolution: Sequence[int]) -> bpy.types.Object:
    """Add a volume whose box −1..1 is mapped to the world by ``matrix`` (4, 4), with ``resolution`` probes per axis."""
    item = bpy.data.objects.new(name, None)
    item.empty_display_type = "CUBE"
    item.empty_display_size = 1.0
    item.matrix_world = Matrix(np.asarray(matrix, float).tolist())
    item[MARK] = 1
    item[RESOLUTION] = [int(count) for count in resolution]
    scene.collection.objects.link(item)
    return item
