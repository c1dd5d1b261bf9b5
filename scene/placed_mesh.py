# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with their materials and places, joined to the arrays that describe all surface of a scene."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.kept import Kept
from .geometry import MeshArrays, place
from .materials import apply_domain
from .shader_values import Domain
from .surface_parts import AtlasUVs
from .surface_values import ATLAS


@dataclass(frozen=True)
class PlacedMesh:
    """Instances of one mesh that look alike. M material slots, I instances."""

    mesh: MeshArrays
    rows: np.ndarray  # (M,) int32 rows of the table of materials
    domains: list[Domain | None]  # of each slot: where its textures lie; None where it has none
    holes: np.ndarray  # (M,) bool: nothing is there, and the row means nothing
    atlases: list[AtlasUVs]
    matrices: np.ndarray  # (I, 4, 4) float64
    first_object: int  # number of the first instance


_MOST_KEPT = 1 << 20  # triangles: of more it takes too long to follow one that moves whatever is kept
_kept_surfaces: list[Kept] = []  # of each group by its place: all but one, where something moves, are what they were


def joined_surface(placed: list[PlacedMesh]) -> tuple[dict[str, np.ndarray], list[tuple[int, int]]]:
    """The arrays of ``SceneSnapshot`` that describe surface, by name, and (number in ``placed``, slot) of textures
    whose UV map the mesh does not have: one point of them shows all over."""
    parts, without_uvs = [], []
    keeps = sum(len(group.mesh.triangles) * len(group.matrices) for group in placed) <= _MOST_KEPT
    for index, group in enumerate(placed):
        if keeps and index == len(_kept_surfaces):
            _kept_surfaces.append(Kept(_world_surface, last=1))
        part, missing = (_kept_surfaces[index] if keeps else _world_surface)(group)
        without_uvs += [(index, slot) for slot in missing]
        if part is not None:
            parts.append(part)
    return _joined(parts), without_uvs


def _world_surface(group: PlacedMesh) -> tuple[dict[str, np.ndarray] | None, list[int]]:
    """World triangles of ``group`` with their per-triangle arrays, None where nothing is left; slots without UVs."""
    mesh, count = group.mesh, len(group.matrices)
    slots = np.clip(mesh.slots, 0, len(group.rows) - 1)
    uvs, missing = _corner_uvs(mesh, slots, group.domains)
    for chosen, own in group.atlases:
        uvs[chosen] = own
    visible = ~group.holes[slots]
    if not visible.any():
        return None, missing
    if not visible.all():
        mesh = MeshArrays(
            mesh.vertices, mesh.triangles[visible], mesh.corner_normals[visible], mesh.slots[visible], {}, ""
        )
        slots, uvs = slots[visible], uvs[visible]
    world = place(mesh, uvs, group.matrices)
    return {
        "vertices": world.vertices,
        "triangles": world.triangles,
        "corner_normals": world.corner_normals,
        "corner_uvs": world.corner_uvs,
        "material_index": np.tile(group.rows[slots], count),
        "object_index": np.repeat(group.first_object + np.arange(count, dtype=np.int32), len(slots)),
    }, missing


def _corner_uvs(mesh: MeshArrays, slots: np.ndarray, domains: list[Domain | None]) -> tuple[np.ndarray, list[int]]:
    """(T, 3, 2) float32 texture coordinates, each triangle's through its own material's mapping; and slots without."""
    uvs = np.zeros((len(mesh.triangles), 3, 2), np.float32)
    missing = []
    for slot in np.unique(slots):
        domain = domains[slot]
        if domain is None or domain == ATLAS:
            continue
        source = mesh.uv_maps.get(domain.uv_map or mesh.active_uv_map)
        if source is None:
            missing.append(int(slot))
            continue
        mine = slots == slot
        uvs[mine] = apply_domain(domain, source[mine])
    return uvs, missing


def _joined(parts: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """One array per field; vertex indices move behind the parts before. The parts stay as they are."""
    if not parts:
        return {
            "vertices": np.empty((0, 3)),
            "triangles": np.empty((0, 3), np.int32),
            "corner_normals": np.empty((0, 3, 3), np.float32),
            "corner_uvs": np.empty((0, 3, 2), np.float32),
            "material_index": np.empty(0, np.int32),
            "object_index": np.empty(0, np.int32),
        }
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    before = np.cumsum([0, *(len(part["vertices"]) for part in parts[:-1])], dtype=np.int32)
    joined["triangles"] += np.repeat(before, [len(part["triangles"]) for part in parts])[:, None]
    return joined
