# SPDX-License-Identifier: GPL-3.0-or-later
"""Trial captures that tell how fast this device rasterises and traces; core/capture_cost.py makes a model of them."""

from __future__ import annotations

import time
from dataclasses import asdict

import numpy as np

from ..core.capture_cost import FEW, MANY, Timings
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.snapshot import Material, SceneSnapshot, World
from .backend import GpuBackend
from .textures import wait_for_gpu

METHODS = ("raster", "trace")
_FACE = 16
_PROBES, _MORE_PROBES = 8, 256  # the second where the first is too little work to be timed
_SHORT_SECONDS = 1e-3
# The first run compiles; of the others the fastest counts, because others at work only ever make things slower. Slow
# devices repeat less.
_LEAST_RUNS, _MOST_RUNS, _ENOUGH_SECONDS = 4, 8, 0.01


def time_captures() -> dict:
    """Timings of this device as JSON values. Takes a few milliseconds on a GPU and a tenth of a second in software,
    besides what the driver needs to compile two shaders."""
    few, many = _Trial(FEW), _Trial(MANY)
    found = {f"{method}_one": few.seconds(method, 1) for method in METHODS}
    for probes in (_PROBES, _MORE_PROBES):
        found |= {f"{method}_many": many.seconds(method, probes) for method in METHODS}
        if max(found[f"{method}_many"] for method in METHODS) > _SHORT_SECONDS:
            break
    found |= {f"{method}_few": few.seconds(method, probes) for method in METHODS}
    return asdict(Timings(face=_FACE, probes=probes, **found))


class _Trial:
    """A room of FEW triangles with small ones strewn in it, as many as it takes."""

    def __init__(self, triangles: int):
        grid = Grid.from_bounds((-2.0,) * 3, (2.0,) * 3, (7, 7, 7))
        self._backend = GpuBackend(_room(triangles), grid, BakeSettings(face=_FACE))
        nodes = np.arange(grid.count)
        self._backend.set_probes(nodes, grid.positions())

    def seconds(self, method: str, probes: int) -> float:
        """The fastest of a few captures after one that compiles and allocates."""
        times: list[float] = []
        while len(times) < _LEAST_RUNS or (len(times) < _MOST_RUNS and sum(times) < _ENOUGH_SECONDS):
            start = time.perf_counter()
            self._backend.find_hits(0, probes, method)
            wait_for_gpu()
            times.append(time.perf_counter() - start)
        return min(times[1:])


def _room(triangles: int) -> SceneSnapshot:
    """A cube of 6 m of 12 triangles; the rest are 20 cm wide and anywhere in it, always the same."""
    corners = np.array([(x, y, z) for z in (-3, 3) for y in (-3, 3) for x in (-3, 3)], float)
    quads = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    room = corners[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])]
    random = np.random.default_rng(1)
    middles = random.uniform(-2.8, 2.8, (triangles - len(room), 1, 3))
    all_corners = np.concatenate([room, middles + random.normal(0.0, 0.1, (len(middles), 3, 3))])
    count = len(all_corners)
    normals = np.cross(all_corners[:, 1] - all_corners[:, 0], all_corners[:, 2] - all_corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return SceneSnapshot(
        vertices=all_corners.reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        corner_normals=np.repeat(normals[:, None], 3, axis=1).astype(np.float32),
        corner_uvs=np.zeros((count, 3, 2), np.float32),
        material_index=np.zeros(count, np.int32),
        object_index=np.zeros(count, np.int32),
        object_names=["trial"],
        materials=[Material("trial")],
        images=[],
        lights=[],
        world=World(),
    )
