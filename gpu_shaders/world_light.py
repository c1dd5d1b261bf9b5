# SPDX-License-Identifier: GPL-3.0-or-later
"""The world as shaders read it, texels of a cube's faces: without its suns, which are lamps to bakes."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import gpu
import numpy as np

from ..core.snapshot import World
from ..core.world_map import world_texels
from ..core.world_suns import extract_suns
from .scene_textures import SceneTextures
from .textures import upload

# World, face size and texels, by scene: blocks of a bake share them.
_known: WeakKeyDictionary[SceneTextures, tuple] = WeakKeyDictionary()


def send_world(scene: SceneTextures, world: World, face: int) -> gpu.types.GPUTexture:
    """Faces of ``face``² texels one after the other, without the suns of ``world``, which ``scene`` gets as lamps."""
    known = _known.get(scene)
    if known is None or known[0] is not world or known[1] != face:
        rest, suns = extract_suns(world)
        scene.set_suns(suns)
        known = _known[scene] = world, face, world_texture(rest, face)
    return known[2]


def world_texture(world: World, face: int) -> gpu.types.GPUTexture:
    """Radiance of ``world`` as ``world_texels``: faces of ``face``² texels one after the other, an element a texel."""
    rows = np.zeros((6 * face**2, 4), np.float32)
    rows[:, :3] = world_texels(world, face).reshape(-1, 3)
    return upload(rows, "texels")
