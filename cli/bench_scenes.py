# SPDX-License-Identifier: GPL-3.0-or-later
"""The scenes of ``bench``, by the names that requests give them, and the grid that each is lit by."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..core.grid import Grid
from ..core.snapshot import SceneSnapshot
from ..scene.bench_rooms import CORNELL_EDGE_M, build_cornell
from ..scene.gallery import build_gallery
from ..scene.open_file import open_blend
from ..scene.volume_fit import fit_volume

GALLERY, CORNELL = "gallery", "cornell"
_CORNELL_INSET_M, _CORNELL_RESOLUTION = 0.15, (5, 5, 5)


def empty_scene() -> bpy.types.Scene:
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return bpy.context.scene


def load(name: str) -> bpy.types.Scene:
    """``gallery``, ``cornell``, or the .blend of that path. Replaces what Blender has open.

    Raises:
        InputError: the file is none that Blender opens.
    """
    if name == GALLERY:
        return build_gallery(empty_scene())
    if name == CORNELL:
        return build_cornell(empty_scene())
    return open_blend(Path(name))


def grid_of(name: str, snapshot: SceneSnapshot) -> Grid:
    """The scene's first volume, or one fitted to it."""
    if name == CORNELL:
        low, high = _CORNELL_INSET_M, CORNELL_EDGE_M - _CORNELL_INSET_M
        return Grid.from_bounds((low,) * 3, (high,) * 3, _CORNELL_RESOLUTION)
    if not snapshot.volumes:
        return fit_volume(snapshot)
    volume = snapshot.volumes[0]
    return Grid(volume.matrix, volume.resolution, volume.name)
