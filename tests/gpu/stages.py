# SPDX-License-Identifier: GPL-3.0-or-later
"""One bake taken apart: every stage on the GPU, read back, beside the reference fed with what the GPU had before that
stage."""

import numpy as np
from gridlight.core.conventions import INVALID
from gridlight.core.cubemap import octahedral_decode
from gridlight.core.field import Field
from gridlight.core.orientation import inside_solid
from gridlight.core.reference_bake import ReferenceBake, TexelSurfaces
from gridlight.gpu_shaders.backend import GpuBackend
from shader_runner import read_layers

BACKGROUND = 1e29  # distances from here on


class Stages:
    """Captures ``snapshot`` for all of the grid's active probes at once."""

    def __init__(self, snapshot, grid, settings, method="trace"):
        self.reference = ReferenceBake(snapshot, grid, settings)
        self.settings, self.grid = settings, grid
        self.backend = GpuBackend(snapshot, grid, settings)
        nodes = self.reference.nodes
        self.backend.set_probes(nodes, grid.positions()[nodes])
        self.backend.allocate_field()
        self.gpu = self.backend.surfaces(0, len(nodes))
        self.capture(method)

    def capture(self, method):
        self.backend.capture(self.gpu, method)
        self.object = self._texels("geometry")[..., 3]

    def _texels(self, name):
        """(P, X, 4)"""
        face = self.settings.face
        layers = read_layers(self.gpu.textures[name], face, 6 * face, self.gpu.count)
        return layers.reshape(self.gpu.count, 6 * face * face, 4)

    def triangles(self):
        """(P, X) the triangle that each texel hit, as the snapshot counts; −1 background."""
        face = self.settings.face
        hits = read_layers(self.backend._hits.texture, face, face, 6 * self.gpu.count)[..., 0].astype(int)
        hits = hits.reshape(self.gpu.count, 6 * face * face)
        return np.where(hits >= 0, self.backend.scene.hierarchy.order[hits], -1)

    def surfaces(self):
        """The GPU's texel surfaces as the reference keeps them."""
        geometry, albedo, emission = (self._texels(name) for name in ("geometry", "albedo", "emission"))
        distance = np.abs(geometry[..., 2]).astype(float)
        distance[distance > BACKGROUND] = np.inf
        normal = octahedral_decode(geometry[..., :2])
        return TexelSurfaces(
            distance,
            self.triangles(),
            geometry[..., 2] < 0,
            normal,
            albedo[..., :3].astype(float),
            emission[..., :3].astype(float),
        )

    def statistics(self):
        """The GPU's states and depth as a field without light."""
        backend, nodes = self.backend, self.reference.nodes
        backend.set_shells(self.reference.shells(self.surfaces(), self.source()))
        backend.statistics(self.gpu)
        shares = backend.read_shares()
        field = Field.empty(self.grid, self.settings.bands)
        field.state[:] = self.reference.state
        field.state[nodes[inside_solid(shares)]] = INVALID
        field.validity[nodes] = 1 - shares[:, 0]
        field.depth[nodes] = backend.read_depth()
        backend.set_states(field.state)
        return field

    def source(self):
        """(P, X, 3)"""
        self.backend.direct_light(self.gpu)
        return self._texels("source")[..., :3]

    def lookups(self):
        """Nodes (P, X, 8) and weights (P, X, 8) as stored, zero where there is no surface."""
        self.backend.weigh_lookups(self.gpu)
        weights = np.concatenate([self._texels("weights0"), self._texels("weights1")], axis=-1).astype(float)
        first = self._texels("geometry")[..., 3].astype(int)
        nx, ny, nz = self.grid.resolution
        corner = np.arange(8)
        step = (corner & 1) + nx * ((corner >> 1 & 1) + ny * (corner >> 2))
        nodes = np.clip(first[..., None] + step, 0, self.grid.count - 1)
        return nodes, np.where(first[..., None] >= 0, weights, 0.0)

    def iterate(self, times):
        """(P, K, 3) the field after ``times`` iterations."""
        for index in range(times):
            self.backend.iterate(self.gpu, read_field=index > 0)
            self.backend.finish_iteration()
        return self.backend.read_field()

    def reference_field(self, surfaces, source, field, lookups, times):
        """The same by the reference."""
        nodes, weights = lookups
        total = weights.sum(axis=-1, keepdims=True)
        lookups = nodes, weights / np.where(total > 0, total, 1)
        field.coefficients = np.zeros((self.grid.count, self.settings.bands**2, 3))
        for _ in range(times):
            field.coefficients = self.reference.iterate(surfaces, source, field, lookups)
        return field.coefficients
