# SPDX-License-Identifier: GPL-3.0-or-later
"""How the field changes where probes move, on the GPU: see core/gradients.py."""

from __future__ import annotations

import gpu
import numpy as np

from ..core.emitters import PROBE_POINTS
from ..core.gradients import gradient_bands, least_distance, texel_edges
from ..core.grid import Grid
from .gloss_pass import GlossPass
from .programs import program
from .textures import allocate, read, upload


class GradientPass:
    """Gradients of all slots. ``emitted``: what points on sampled emitters add, which emission_project_comp writes."""

    def __init__(self, face: int, bands: int, grid: Grid):
        self.face = face
        self.bands = gradient_bands(bands)
        self.coefficients = self.bands**2
        self.nearest = least_distance(grid)
        edges = texel_edges(face)
        rows = np.zeros((len(edges.first), 2, 4), np.float32)
        rows[:, 0, :3], rows[:, 0, 3] = edges.across, edges.first
        rows[:, 1, :3], rows[:, 1, 3] = edges.direction, edges.second
        self._edges = upload(rows, "edges of texels")
        self._slots = 0

    def allocate(self, slots: int) -> None:
        """All zero."""
        self._slots = slots
        self._result = self._zeros()
        self.forget_emission()

    @property
    def texture(self) -> gpu.types.GPUTexture:
        """Gradients of all slots."""
        return self._result

    def forget_emission(self) -> None:
        """No probe sees a sampled emitter."""
        self.emitted = self._zeros()

    def _zeros(self) -> gpu.types.GPUTexture:
        return allocate(self._slots * 3 * self.coefficients, "field gradients")

    def project(
        self,
        textures: dict,
        first_slot: int,
        layers: tuple[gpu.types.GPUTexture, int],
        texel_weights: gpu.types.GPUTexture,
        irradiance: gpu.types.GPUTexture,
        own_texels: bool,
        group: int,
        gloss: GlossPass,
        mirrored_irradiance: gpu.types.GPUTexture,
    ) -> None:
        """Gradients by the texel surfaces ``textures`` (geometry, albedo, emission) of ``layers``, a list and its
        length; ``first_slot`` is the slot of layer 0. ``irradiance`` is that of patches, or of every texel by itself
        where ``own_texels``; what they mirror is lit by ``mirrored_irradiance``, that of patches."""
        listed, count = layers
        shader = program(
            "field_gradient_comp",
            FACE=self.face,
            BANDS=self.bands,
            COEFFICIENTS=self.coefficients,
            GROUP=group,
            CANDIDATE_COUNT=PROBE_POINTS,
            **gloss.defines,
        )
        gloss.bind(shader, textures, mirrored_irradiance)
        shader.uniform_sampler("probe_layers", listed)
        shader.uniform_sampler("texel_edges", self._edges)
        shader.uniform_sampler("texel_weights", texel_weights)
        shader.uniform_sampler("patch_irradiance", irradiance)
        shader.uniform_sampler("emitted_gradient", self.emitted)
        for name in ("geometry", "albedo", "emission"):
            shader.uniform_sampler(name, textures[name])
        shader.image("field_gradient", self._result)
        shader.uniform_int("first_slot", (first_slot,))
        shader.uniform_int("own_texels", (int(own_texels),))
        shader.uniform_float("nearest", self.nearest)
        gpu.compute.dispatch(shader, count, 1, 1)

    def read(self) -> np.ndarray:
        """(slots, 3, coefficients, 3) float32 copy, not limited."""
        values = read(self._result, self._slots * 3 * self.coefficients)
        return np.ascontiguousarray(values[:, :3]).reshape(self._slots, 3, self.coefficients, 3)
