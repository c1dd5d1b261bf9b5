# SPDX-License-Identifier: GPL-3.0-or-later
"""Places at which light is measured: points of patches, or texels by themselves."""

from __future__ import annotations

from dataclasses import dataclass

import gpu

from .dispatch import dispatch_linear
from .programs import program
from .scene_textures import SceneTextures


@dataclass(frozen=True)
class Places:
    """``points``: ``each`` elements (position, packed normal) for every patch or texel. ``sheets``: the number of the
    sheet that each is part of, None in scenes without (core/sheets.py). ``couplings``, 2 elements each: how each takes
    light of grazing angles, see place_coupling_comp; None where all do alike (core/faint_gloss.py)."""

    points: gpu.types.GPUTexture
    each: int
    sheets: gpu.types.GPUTexture | None
    couplings: gpu.types.GPUTexture | None = None

    @property
    def defines(self) -> dict:
        """For shaders that light them."""
        return {"HAS_COUPLING": self.couplings is not None}

    def bind_couplings(self, shader) -> None:
        """Binds what a shader compiled with ``defines`` declares."""
        if self.couplings is not None:
            shader.uniform_sampler("couplings", self.couplings)


def find_couplings(scene: SceneTextures, points, each: int, first: int, count: int, target) -> None:
    """Couplings of ``count`` places from ``first`` on of ``points``, ``each`` of a place, into ``target``."""
    shader = program("place_coupling_comp", POINTS=each, **scene.surface_defines)
    scene.bind_surfaces(shader)
    shader.uniform_sampler("patch_points", points)
    shader.image("couplings", target)
    shader.uniform_int("first_place", (first,))
    shader.uniform_int("place_count", (count,))
    dispatch_linear(shader, count)
