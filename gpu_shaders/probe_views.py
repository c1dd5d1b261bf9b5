# SPDX-License-Identifier: GPL-3.0-or-later
"""What probes see around them, for deciding where they stand and whether they count; see bake/placement.py."""

from __future__ import annotations

import gpu
import numpy as np

from .backend import GpuBackend, Surfaces
from .programs import program
from .textures import allocate, numbers, read


def sightings(backend: GpuBackend, surfaces: Surfaces) -> np.ndarray:
    """(count, 384): which objects each probe sees, see core/orientation.py. Needs direct light."""
    result = allocate(surfaces.count * 96, "sightings")
    shader = program("object_sightings_comp", FACE=backend.face, **backend.gloss.defines)
    backend.gloss.bind(shader, surfaces.textures, backend.light.direct)
    shader.uniform_sampler("patch_irradiance", backend.light.direct)
    backend.scene.bind(shader, "triangle_attributes")
    for name in ("geometry", "albedo", "emission"):
        shader.uniform_sampler(name, surfaces.textures[name])
    shader.image("sightings", result)
    gpu.compute.dispatch(shader, surfaces.count, 1, 1)
    return read(result, surfaces.count * 96).reshape(surfaces.count, -1)


def exits(backend: GpuBackend, surfaces: Surfaces, layers_: np.ndarray) -> np.ndarray:
    """(L, 6, 4) offset and distance of the nearest surface in each face, for the probes in ``layers_`` (L,)."""
    slots, result = numbers(layers_, "probes"), allocate(len(layers_) * 6, "exits")
    shader = program("probe_exits_comp", FACE=backend.face)
    shader.uniform_sampler("slots", slots)
    shader.uniform_sampler("geometry", surfaces.textures["geometry"])
    shader.image("exits", result)
    gpu.compute.dispatch(shader, len(layers_), 1, 1)
    return read(result, len(layers_) * 6).reshape(-1, 6, 4)
