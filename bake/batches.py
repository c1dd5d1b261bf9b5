# SPDX-License-Identifier: GPL-3.0-or-later
"""Texel surfaces of all active probes in batches, kept while they fit the budget and captured again where not."""

from __future__ import annotations

import numpy as np

from ..core.steps import Pace, Steps
from ..gpu_shaders.backend import GpuBackend, Surfaces
from ..gpu_shaders.change_pass import move_layers
from .stopwatch import Stopwatch

_REFLECT_AT_ONCE = 256  # probes, whose rays take 100 MiB with faces of 16


class Batches:
    """Slots 0 .. S−1 of the backend in order, cut into batches. ``captures`` counts probes captured so far."""

    def __init__(self, backend: GpuBackend, nodes: np.ndarray, method: str, stopwatch: Stopwatch, pace: Pace):
        """``nodes`` (S,) grid indices of the slots; ``method`` "raster" or "trace"."""
        self._backend = backend
        self._method = method
        self.stopwatch = stopwatch
        self.pace = pace
        self.captures = 0
        self._cut(nodes)

    def _cut(self, nodes: np.ndarray) -> None:
        self.nodes = nodes
        slots = len(nodes)
        self.resident = slots <= self._backend.probes_in_budget
        self._size = max(min(self._backend.probes_per_batch, slots), 1)
        self.count = -(-slots // self._size)
        self._kept: dict[int, Surfaces] = {}
        self._bound: set[int] = set()

    def range(self, index: int) -> tuple[int, int]:
        """First slot and number of slots of batch ``index``."""
        first = index * self._size
        return first, min(self._size, len(self.nodes) - first)

    def slots_of(self, index: int, slots: np.ndarray) -> np.ndarray:
        """Those of ``slots`` that are in batch ``index``."""
        first, count = self.range(index)
        return slots[(slots >= first) & (slots < first + count)]

    def captured(self, index: int) -> Steps[Surfaces]:
        """Batch ``index`` with geometry, albedo and emission; in steps where it must be captured first."""
        if index not in self._kept:
            if not self.resident:
                self.drop()  # frees the images of the batch before
            surfaces = self._backend.surfaces(*self.range(index))
            yield from self.stopwatch.steps("capture", self._capture(surfaces, 0, surfaces.count))
            self._kept[index] = surfaces
        return self._kept[index]

    def bound(self, index: int) -> Steps[Surfaces]:
        """The same with the patches that texels lie on."""
        surfaces = yield from self.captured(index)
        if index not in self._bound:
            yield from self.stopwatch.steps("light", self._backend.bind(surfaces))
            self._bound.add(index)
        return surfaces

    def reflect_again(self) -> Steps[None]:
        """What glossy texels mirror anew, in steps, for other lamps or another world. What is not kept sees it when it
        is captured again."""
        for index in sorted(self._bound):
            surfaces = self._kept[index]
            for first in range(0, surfaces.count, _REFLECT_AT_ONCE):
                number = min(_REFLECT_AT_ONCE, surfaces.count - first)
                yield from self.stopwatch.steps("light", self._backend.reflect(surfaces, first, number))

    def capture_again(self, slots: np.ndarray) -> Steps[None]:
        """Captures probes ``slots`` (L,), ascending, anew, in steps: they moved or see something else."""
        for index in range(self.count):
            mine = self.slots_of(index, slots)
            if index not in self._kept or not len(mine):
                continue  # what is not kept is captured when it is asked for
            surfaces = self._kept[index]
            layers = mine - surfaces.first
            for run in np.split(layers, np.flatnonzero(np.diff(layers) > 1) + 1):
                start, count = int(run[0]), len(run)
                yield from self.stopwatch.steps("capture", self._capture(surfaces, start, count))
                if index in self._bound:
                    yield from self.stopwatch.steps("light", self._backend.bind(surfaces, start, count))

    def _capture(self, surfaces: Surfaces, start: int, count: int) -> Steps[None]:
        def capture(first: int, number: int) -> None:
            self._backend.capture(surfaces, self._method, start + first, number)

        yield from self.pace.portions("capture", count, capture)
        self.captures += count

    def unbind(self) -> None:
        """Forgets which patches texels lie on."""
        self._bound.clear()

    def drop(self) -> None:
        """Forgets all texel surfaces."""
        self._kept.clear()
        self._bound.clear()

    def regroup(self, nodes: np.ndarray) -> np.ndarray:
        """Makes ``nodes`` (S,) the slots and takes over texel surfaces of those that were there before; none is bound.

        Returns the slots (L,) that have none, which the caller captures. Where surfaces are not resident all are
        dropped.
        """
        old_nodes, old_kept = self.nodes, self._kept
        place = np.full(max(old_nodes.max(initial=0), nodes.max(initial=0)) + 1, -1)
        place[old_nodes] = np.arange(len(old_nodes))
        old_slot = place[nodes]
        was_resident = self.resident
        self._cut(nodes)
        if not (was_resident and self.resident):
            return np.arange(len(nodes))
        for index in range(self.count):
            first, count = self.range(index)
            surfaces = self._kept[index] = self._backend.surfaces(first, count)
            for old in old_kept.values():
                layer = old_slot[first : first + count] - old.first
                layer[(layer < 0) | (layer >= old.count) | (old_slot[first : first + count] < 0)] = -1
                if (layer >= 0).any():
                    move_layers(self._backend, old, surfaces, layer)
        return np.flatnonzero(old_slot < 0)
