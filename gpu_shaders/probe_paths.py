# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths from places in a scene, followed to the end of their light: what probes there should hold, without a bake."""

from __future__ import annotations

import numpy as np

from ..core.grid import Grid
from ..core.path_check import SETS
from ..core.snapshot import SceneSnapshot
from ..core.world_suns import extract_suns
from .dispatch import dispatch_linear
from .programs import program
from .scene_textures import SceneTextures
from .textures import allocate, read, upload
from .world_light import world_texture

_FACE = 32  # of the world as paths see it, without its suns
_PARTS = 3  # samples a path writes: itself, a point on an emitter, a place on a sun
_PATHS_AT_ONCE = 1 << 19
MOST_BOUNCES = 512


class ProbePaths:
    """Paths from ``positions`` (K, 3), world metres, through the scene that a bake holds on the GPU."""

    def __init__(self, scene: SceneTextures, snapshot: SceneSnapshot, grid: Grid, positions: np.ndarray):
        self._scene = scene
        rows = np.zeros((len(positions), 4), np.float32)
        rows[:, :3] = positions - grid.center
        self.count = len(positions)
        self._points = upload(rows, "probes")
        self._world = world_texture(extract_suns(snapshot.world)[0], _FACE)

    def trace(
        self, first: int, count: int, bounces: int | None, seed: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Paths ``first`` .. ``first + count`` of the sequences that belong to ``seed``, one a set, from every place.

        ``bounces``: how often light is reflected between surfaces before a place sees it; None for to its end.
        Returns directions (SETS, K, 3·count, 3), radiance over density of the same shape: divided by the number of
        paths, the sum of a set is the integral over the sphere; and (K,) the share of paths that first meet a surface
        from behind.
        """
        directions, flux, behind = [], [], np.zeros(self.count)
        at_once = max(1, _PATHS_AT_ONCE // (SETS * self.count))
        for start in range(first, first + count, at_once):
            part = min(at_once, first + count - start)
            towards, brought = self._trace(start, part, bounces, seed)
            behind += towards[:, :, ::_PARTS, 3].sum(axis=(0, 2))
            directions.append(towards[..., :3])
            flux.append(brought)
        return np.concatenate(directions, axis=2), np.concatenate(flux, axis=2), behind / (SETS * count)

    def _trace(self, first: int, count: int, bounces: int | None, seed: int) -> tuple[np.ndarray, np.ndarray]:
        scene, paths = self._scene, SETS * self.count * count
        directions, flux = (allocate(_PARTS * paths, "paths") for _ in range(2))
        shader = program(
            "probe_paths_comp", FACE=_FACE, **(scene.path_defines | {"HAS_COUPLING": scene.has_faint_gloss})
        )
        scene.bind_surfaces(shader)
        scene.bind_lights(shader)
        scene.bind_sheets(shader)
        scene.bind_gloss(shader)
        shader.uniform_sampler("probe_points", self._points)
        shader.uniform_sampler("world_texels", self._world)
        shader.image("directions", directions)
        shader.image("flux_out", flux)
        for name, value in (
            ("path_count", paths),
            ("probe_count", self.count),
            ("paths_each", count),
            ("first_number", first),
            ("first_sun", scene.light_count),
            ("bounces", MOST_BOUNCES if bounces is None else bounces),
            ("seed", seed),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, paths)
        shape = (SETS, self.count, _PARTS * count, 4)
        elements = _PARTS * paths
        return read(directions, elements).reshape(shape), read(flux, elements).reshape(shape)[..., :3].astype(float)
