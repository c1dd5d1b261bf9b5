# SPDX-License-Identifier: GPL-3.0-or-later
"""What paths of light tell at some places, as many as it takes, in steps (gpu_shaders/probe_paths.py,
core/path_check.py)."""

from __future__ import annotations

import numpy as np

from ..core.grid import Grid
from ..core.path_check import SETS, PathCheck
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..core.steps import Pace, Steps
from ..gpu_shaders.probe_paths import ProbePaths
from ..gpu_shaders.scene_textures import SceneTextures
from .stopwatch import Stopwatch

_SEED = 0x5EED  # besides the bake's own


class FollowedPaths:
    """``check`` is what is known so far. ``places`` (K, 3) are world metres, ``drawn_from`` is PathCheck's; of
    ``settings`` bounces and seed count."""

    def __init__(
        self,
        scene: SceneTextures,
        snapshot: SceneSnapshot,
        grid: Grid,
        places: np.ndarray,
        settings: BakeSettings,
        stopwatch: Stopwatch,
        pace: Pace,
        drawn_from: int | None = None,
    ):
        self.check = PathCheck(len(places), drawn_from=drawn_from)
        self._paths = ProbePaths(scene, snapshot, grid, places)
        self._bounces, self._seed = settings.bounces, (settings.seed + _SEED) & 0x7FFFFFFF
        self._stopwatch, self._pace = stopwatch, pace

    @property
    def count(self) -> int:
        """Paths followed so far, from all places."""
        return SETS * self.check.paths * self._paths.count

    def follow(self, count: int) -> Steps[np.ndarray]:
        """Follows ``count`` more of each place and set; returns (K,) the share of them that first meet a surface from
        behind."""
        behind, first = np.zeros(self._paths.count), self.check.paths

        def some(start: int, number: int) -> None:
            directions, flux, share = self._paths.trace(first + start, number, self._bounces, self._seed)
            self.check.add(directions, flux, number)
            behind[:] += share * number / count

        yield from self._stopwatch.steps("light", self._pace.portions("paths", count, some))
        return behind
