# SPDX-License-Identifier: GPL-3.0-or-later
"""Which triangles of a scene show which material, for materials that need an atlas of all their surface."""

from __future__ import annotations

import bpy
import numpy as np

from .surface_atlas import fits
from .surface_samples import Part, SurfaceSamples

# (T,) bool of the triangles of a group that show a material, and their (T', 3, 2) atlas coordinates.
AtlasUVs = tuple[np.ndarray, np.ndarray]


class SurfaceParts:
    """Groups of instances, each with its materials per slot; atlases are made when they are asked for."""

    def __init__(self):
        self._groups: list[tuple] = []  # group, materials per slot
        self._samples: dict[int, SurfaceSamples | None] = {}
        self._part: dict[tuple[int, int], int] = {}  # material, group -> part

    def add(self, group, slots: list[bpy.types.Material | None]) -> None:
        """``group`` has ``mesh``, ``matrices`` and ``facts``; ``slots`` are the materials that its triangles show."""
        self._groups.append((group, slots))

    def samples(self, material: bpy.types.Material) -> SurfaceSamples | None:
        """The atlas of all surface that shows ``material``; None where that has too many triangles."""
        key = material.as_pointer()
        if key not in self._samples:
            parts: list[Part] = []
            for group, slots in self._groups:
                shows = np.array([slot == material for slot in slots] or [False])
                chosen = shows[np.clip(group.mesh.slots, 0, len(shows) - 1)]
                if chosen.any():
                    self._part[key, id(group)] = len(parts)
                    parts.append(Part(group.mesh, chosen, group.matrices[0], group.facts))
            whole = fits(sum(int(part.chosen.sum()) for part in parts))
            self._samples[key] = SurfaceSamples(parts) if whole else None
        return self._samples[key]

    def corner_uvs(self, material: bpy.types.Material, group) -> AtlasUVs | None:
        """Where ``group`` shows ``material`` in its atlas; None where it does not show it at all."""
        samples = self.samples(material)
        part = self._part.get((material.as_pointer(), id(group)))
        return None if part is None else (samples.parts[part].chosen, samples.corner_uvs(part))
