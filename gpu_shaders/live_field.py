# SPDX-License-Identifier: GPL-3.0-or-later
"""Shown light that follows a bake on the GPU, without ever leaving it.

Probes are relit a few at a time. Shown at once, each would jump by itself and the picture would flicker; so all of the
shown field goes a share of the way to what probes have by now, again and again.
"""

from __future__ import annotations

import numpy as np

from ..core.conventions import ACTIVE
from ..core.dilation import neighbours
from ..core.field import Field
from ..core.gradients import cell_axes
from .backend import GpuBackend
from .dispatch import dispatch_linear
from .programs import program
from .textures import allocate, upload
from .viewport_field import FieldTextures
from .viewport_shading import uniform_block

_SWEEPS = 4  # each time, over nodes without light of their own


class LiveField:
    """Leads ``shown`` to the field of ``backend``. Both must be of one grid, with the same probes in the same
    places."""

    def __init__(self, backend: GpuBackend, shown: FieldTextures):
        self._backend = backend
        self._shown = shown
        field = shown.field
        self._defines = {
            "COEFFICIENTS": field.coefficients.shape[1],
            "TRANSFER_COEFFICIENTS": field.gradient.shape[2],
        }
        rows = np.zeros((3, 4), np.float32)
        rows[:, :3] = cell_axes(field.grid).T
        self._cells = uniform_block(rows)
        self._beside = upload(_slots_beside(backend.slot_nodes, field), "probes")
        self._steepness = allocate(backend.slot_count, "probes")
        dark = np.flatnonzero(~field.holds_light) if (field.state == ACTIVE).any() else np.zeros(0, int)
        self._dark_count = len(dark)
        fill = np.full((len(dark), 8), -1.0, np.float32)
        fill[:, :6], fill[:, 6] = neighbours(field.grid, dark), dark
        self._fill = upload(fill, "grid nodes")

    def follow(self, share: float) -> None:
        """Goes ``share`` (0..1) of the way that is left."""
        field, gradient = self._backend.light_textures
        textures = self._shown.light_textures
        shader = program("live_steepness_comp", **self._defines)
        shader.uniform_sampler("slot_neighbours", self._beside)
        shader.uniform_sampler("target_field", field)
        shader.uniform_sampler("target_gradient", gradient)
        shader.image("steepness", self._steepness)
        shader.uniform_block("cell_info", self._cells)
        shader.uniform_int("slot_count", (self._backend.slot_count,))
        dispatch_linear(shader, self._backend.slot_count)
        shader = program("live_field_comp", **self._defines)
        shader.uniform_sampler("steepness", self._steepness)
        shader.uniform_sampler("probe_slots", self._backend.probe_slots)
        shader.uniform_sampler("target_field", field)
        shader.uniform_sampler("target_gradient", gradient)
        shader.image("field", textures[0])
        shader.image("gradient", textures[1])
        shader.uniform_block("cell_info", self._cells)
        shader.uniform_int("slot_count", (self._backend.slot_count,))
        shader.uniform_float("share", share)
        dispatch_linear(shader, self._backend.slot_count * self._defines["COEFFICIENTS"])
        for _ in range(_SWEEPS if self._dark_count else 0):
            shader = program("live_fill_comp", COEFFICIENTS=self._defines["COEFFICIENTS"])
            shader.uniform_sampler("fill_nodes", self._fill)
            shader.image("field", textures[0])
            shader.uniform_int("node_count", (self._dark_count,))
            dispatch_linear(shader, self._dark_count * self._defines["COEFFICIENTS"])


def _slots_beside(nodes: np.ndarray, field: Field) -> np.ndarray:
    """(slots, 8) float32: slots of the active neighbours of each active one of ``nodes`` (slots,), −1 where there is
    none, and twice nothing."""
    slots = np.full(field.grid.count, -1)
    active = field.state[nodes] == ACTIVE
    slots[nodes[active]] = np.flatnonzero(active)
    around = neighbours(field.grid, nodes)
    beside = np.full((len(nodes), 8), -1.0, np.float32)
    beside[:, :6] = np.where((around >= 0) & active[:, None], slots[around], -1)
    return beside
