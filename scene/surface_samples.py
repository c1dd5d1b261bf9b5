# SPDX-License-Identifier: GPL-3.0-or-later
"""What shader nodes can ask of a place on a surface, for all texels of a material's atlas: coordinates, attributes,
what the object is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .geometry import MeshArrays, place
from .instance_facts import InstanceFacts
from .node_links import Unsupported
from .surface_atlas import Atlas, lay_out


@dataclass
class Part:
    """The triangles of one mesh that show the material, with the mesh's first instance."""

    mesh: MeshArrays
    chosen: np.ndarray  # (T,) bool
    matrix: np.ndarray  # (4, 4) float64
    facts: InstanceFacts


class SurfaceSamples:
    """Values at the texels of an atlas over ``parts``; P texels."""

    def __init__(self, parts: list[Part]):
        self.parts = parts
        self.missing: set[str] = set()  # attributes and UV maps that some mesh was asked for in vain
        self._counts = [int(part.chosen.sum()) for part in parts]
        self._known: dict[str, np.ndarray] = {}
        corners = self._joined(
            lambda part: part.mesh.vertices[part.mesh.triangles[part.chosen]] @ part.matrix[:3, :3].T
        )
        edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        self.atlas: Atlas = lay_out(edges.max(axis=1))

    def corner_uvs(self, index: int) -> np.ndarray:
        """(T', 3, 2) float32 atlas coordinates of the chosen triangles of part ``index``."""
        start = sum(self._counts[:index])
        return self.atlas.corner_uvs[start : start + self._counts[index]]

    def array(self, name: str) -> np.ndarray:
        """(P, 1 or 3) float32. Names: ``position``, ``normal``, ``object``, ``generated``, ``object normal``;
        ``uv NAME``; ``attribute NAME`` and ``alpha NAME``, where no name means the render colour; ``info WHAT`` with a
        field of InstanceFacts or ``alpha``; ``property NAME`` of the object.

        Raises:
            Unsupported: no surface has values of such a name. Where single meshes have none, they are black.
        """
        if name not in self._known:
            self._known[name] = self._compute(name).astype(np.float32)
        return self._known[name]

    def _compute(self, name: str) -> np.ndarray:
        kind, _, rest = name.partition(" ")
        if kind == "info" or kind == "property":
            values = [_fact(part.facts, kind, rest) for part in self.parts]
            width = max(len(value) for value in values)
            rows = [np.resize(value, width) for value in values]
            return np.repeat(rows, self._counts, axis=0)[self.atlas.triangle]
        return self.atlas.interpolate(self._joined(lambda part: self._at_corners(part, kind, rest)))

    def _at_corners(self, part: Part, kind: str, rest: str) -> np.ndarray:
        values = _at_corners(part, kind, rest)
        if values is None:  # as Cycles has it: what is not there is black
            self.missing.add(rest)
            return np.zeros((int(part.chosen.sum()), 3, 1))
        return values

    def _joined(self, of_part) -> np.ndarray:
        """(T, 3, C) of all parts; one channel stands for as many as others have."""
        arrays = [of_part(part) for part in self.parts]
        channels = max(array.shape[-1] for array in arrays)
        return np.concatenate([np.broadcast_to(array, (*array.shape[:-1], channels)) for array in arrays])


def _at_corners(part: Part, kind: str, rest: str) -> np.ndarray | None:
    """(T', 3, 1 or 3) values at the corners of the chosen triangles; None where the mesh has none."""
    mesh, chosen = part.mesh, part.chosen
    if kind == "position":
        return mesh.vertices[mesh.triangles[chosen]] @ part.matrix[:3, :3].T + part.matrix[:3, 3]
    if kind == "normal":
        no_uvs = np.zeros((len(mesh.triangles), 3, 2), np.float32)
        return _upright(place(mesh, no_uvs, part.matrix[None]).corner_normals, part)
    if kind == "object":
        if rest == "normal":
            return mesh.corner_normals[chosen]
        return mesh.vertices[mesh.triangles[chosen]]
    if kind == "generated":
        size = np.where(mesh.texture_size != 0, mesh.texture_size, 0.5)
        return (mesh.vertices[mesh.triangles[chosen]] - mesh.texture_location) / (2 * size) + 0.5
    if kind == "uv":
        uvs = mesh.uv_maps.get(rest or mesh.active_uv_map)
        if uvs is None:
            return None
        return np.concatenate([uvs[chosen], np.zeros((int(chosen.sum()), 3, 1))], axis=2)
    if kind in ("attribute", "alpha"):
        values = mesh.attributes.get(rest)
        if values is None and rest in mesh.uv_maps:
            return _at_corners(part, "uv", rest) if kind == "attribute" else np.ones((int(chosen.sum()), 3, 1))
        if values is None:
            return None
        values = values[chosen]
        if kind == "alpha":
            return values[..., 3:] if values.shape[2] == 4 else np.ones((*values.shape[:2], 1))
        return np.pad(values, ((0, 0), (0, 0), (0, 1))) if values.shape[2] == 2 else values[..., :3]
    raise Unsupported(f"'{kind}' of a surface")


def _upright(normals: np.ndarray, part: Part) -> np.ndarray:
    """Normals as ``place`` gives them, back in the mesh's order of corners, which mirrors turn around."""
    mirrored = np.linalg.det(part.matrix[:3, :3]) < 0
    return normals[part.chosen][:, [0, 2, 1]] if mirrored else normals[part.chosen]


def _fact(facts: InstanceFacts, kind: str, what: str) -> np.ndarray:
    if kind == "property":
        return np.atleast_1d(facts.properties.get(what, (0.0,)))[:3]
    values = {
        "location": facts.location,
        "color": facts.color[:3],
        "alpha": facts.color[3:],
        "index": (facts.index,),
        "random": (facts.random,),
    }
    return np.atleast_1d(np.array(values[what], float))
