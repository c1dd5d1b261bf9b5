# SPDX-License-Identifier: GPL-3.0-or-later
"""Several bakes of one grid put together: the mean of those with each probe's newest face."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core import dilation, gradients
from ..core.conventions import ACTIVE
from ..core.error_budget import Level
from ..core.field import Field
from ..core.path_check import NORMALS, irradiance_of

_SAME_PLACE = 1e-4  # cells


class Passes:
    """P probes. ``spread`` (P,): squared error of irradiance that the last two estimates of a probe tell of, 0 where
    there is one."""

    def __init__(self, field: Field, level: Level):
        """``field``: of the first pass, which decides where probes stand and which count."""
        count = field.grid.count
        self._first = field
        self._weight = np.full(count, level.samples)
        self._faces = np.full(count, level.face)
        self._coefficients = field.coefficients.astype(float) * level.samples
        self._gradient = field.gradient.astype(float) * level.samples
        self.spread = np.zeros(count)
        self._field: Field | None = None

    @property
    def field(self) -> Field:
        """All passes together."""
        if self._field is None:
            self._field = self.field_of(self.mean)
        return self._field

    @property
    def mean(self) -> np.ndarray:
        """(P, K, 3) coefficients, right for active probes."""
        return self._coefficients / self._weight[:, None, None]

    def add(self, field: Field, chosen: np.ndarray, level: Level) -> None:
        """Adds ``field``, a pass at ``level``, for ``chosen`` nodes (L,), except where it placed a probe elsewhere or
        found it to be none."""
        first, grid = self._first, self._first.grid
        self._field = None
        moved = np.abs(field.offset[chosen] - first.offset[chosen]).max(axis=1)
        there = moved <= _SAME_PLACE * float(grid.cell_size().min())
        nodes = chosen[there & (field.state[chosen] == ACTIVE)]
        change = irradiance_of(field.coefficients[nodes], NORMALS) - irradiance_of(self.mean[nodes], NORMALS)
        old, same = self._weight[nodes], self._faces[nodes] == level.face
        # Of two noisy estimates with n and m samples the mean is off by nm/(n+m)² of their squared difference; of two
        # faces the finer one is off by the less the finer it is.
        finer = (self._faces[nodes] / level.face) ** 2
        share = np.where(same, old * level.samples / (old + level.samples) ** 2, finer / (1 + finer))
        self.spread[nodes] = share * (change**2).mean(axis=(1, 2))
        anew = nodes[~same]
        self._coefficients[anew], self._gradient[anew], self._weight[anew] = 0.0, 0.0, 0
        self._coefficients[nodes] += level.samples * field.coefficients[nodes].astype(float)
        self._gradient[nodes] += level.samples * field.gradient[nodes].astype(float)
        self._weight[nodes] += level.samples
        self._faces[nodes] = level.face
        first.depth[nodes] = field.depth[nodes]

    def field_of(self, coefficients: np.ndarray) -> Field:
        """The field with ``coefficients`` (P, K, 3) of active probes, completed for the others."""
        grid, known = self._first.grid, self._first.holds_light
        filled = dilation.fill(grid, coefficients.astype(np.float32), known)
        gradient = (self._gradient / self._weight[:, None, None, None]).astype(np.float32)[:, :, : filled.shape[1]]
        gradient[~known] = 0.0
        gradient = gradients.limited(grid, gradient, filled, self._first.state == ACTIVE)
        return replace(self._first, coefficients=filled, gradient=gradient)
