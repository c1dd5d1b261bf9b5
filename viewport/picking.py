# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probe sphere is under the mouse."""

from __future__ import annotations

import bpy
import numpy as np
from bpy_extras import view3d_utils

from ..core.conventions import ACTIVE
from ..gpu_shaders.viewport_pass import Probes
from .sessions import SceneSession


def probe_at(
    context: bpy.types.Context, session: SceneSession, probes: Probes, place: tuple[int, int]
) -> tuple[str, int] | None:
    """(volume, node) of the nearest sphere at ``place``, pixels of the context's region; None where the scene hides
    it or there is none."""
    region, region_3d = context.region, context.region_data
    origin = np.array(view3d_utils.region_2d_to_origin_3d(region, region_3d, place))
    direction = np.array(view3d_utils.region_2d_to_vector_3d(region, region_3d, place))
    nearest, found = np.inf, None
    for name, field in session.gpu.fields.items():
        grid = field.field.grid
        radius = probes.radius(grid) * np.where(field.field.state == ACTIVE, 1.0, 0.5)
        distance = sphere_distances(field.positions + grid.center, radius, origin, direction)
        node = int(np.argmin(distance))
        if distance[node] < nearest:
            nearest, found = distance[node], (name, node)
    if found is None:
        return None
    hit, place_hit, *_ = context.scene.ray_cast(context.view_layer.depsgraph, origin, direction)
    if hit and np.linalg.norm(np.array(place_hit) - origin) < nearest:
        return None
    return found


def sphere_distances(centres: np.ndarray, radius: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(N,) distances along a ray from ``origin`` (3,), unit ``direction`` (3,), to spheres at ``centres`` (N, 3) with
    ``radius`` (N,); infinite where missed, or where the ray starts within six radii, as such spheres are not drawn."""
    offset = centres - origin
    along = offset @ direction
    half_squared = radius**2 - ((offset**2).sum(axis=1) - along**2)
    entry = along - np.sqrt(np.maximum(half_squared, 0.0))
    hit = (half_squared > 0) & (entry > 0) & (np.linalg.norm(offset, axis=1) >= 6 * radius.max())
    return np.where(hit, entry, np.inf)
