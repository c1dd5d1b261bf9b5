# SPDX-License-Identifier: GPL-3.0-or-later
"""Probe volumes that stand in the scene as Empties. One for a scene that has none: ``volume_fit``."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np
from mathutils import Matrix

from ..core.settings import MAX_RESOLUTION
from ..core.snapshot import Volume

MARK, RESOLUTION = "gridlight_volume", "gridlight_resolution"


def find_volumes(scene: bpy.types.Scene) -> list[Volume]:
    """Volumes of ``scene``, by name: box Empties marked by the custom property ``gridlight_volume``.

    The Empty's box is its display size, a cube of half edge ``empty_display_size``, through its world transform.
    Volumes may be hidden; a bake reads them all the same.
    """
    return [
        Volume(item.name, box_of(item), resolution_of(item))
        for item in sorted(scene.objects, key=lambda item: item.name)
        if is_volume(item)
    ]


def is_volume(item: bpy.types.Object | None) -> bool:
    """Whether ``item`` is an Empty marked as a probe volume."""
    return item is not None and item.type == "EMPTY" and bool(item.get(MARK))


def eevee_volumes(scene: bpy.types.Scene) -> list[str]:
    """Names of EEVEE's own light probe volumes in ``scene``, which a bake leaves alone."""
    return [item.name for item in scene.objects if item.type == "LIGHT_PROBE" and item.data.type == "VOLUME"]


def box_of(item: bpy.types.Object) -> np.ndarray:
    """(4, 4) float64 that maps the box −1..1 to the volume's place in the world, parents and animation included."""
    matrix = np.array(item.matrix_world, float)
    matrix[:3, :3] *= item.empty_display_size
    return matrix


def resolution_of(item: bpy.types.Object) -> tuple[int, int, int]:
    """Probes along the volume's own axes."""
    nx, ny, nz = (int(count) for count in item.get(RESOLUTION, (2, 2, 2)))
    return nx, ny, nz


def resolution_for(box: np.ndarray, spacing: float) -> tuple[int, int, int]:
    """Probes per axis whose distance comes nearest to ``spacing`` metres in ``box`` (4, 4)."""
    cells = np.rint(2 * np.linalg.norm(box[:3, :3], axis=0) / spacing)
    nx, ny, nz = (int(count) for count in np.clip(cells + 1, 2, MAX_RESOLUTION))
    return nx, ny, nz


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
