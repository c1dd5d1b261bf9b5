# SPDX-License-Identifier: GPL-3.0-or-later
"""Another state of a scene, as a snapshot in which one thing differs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from gridlight.core.snapshot import SceneSnapshot


def with_light(snapshot: SceneSnapshot, index: int, **values) -> SceneSnapshot:
    """Light ``index`` with other ``values``."""
    lights = list(snapshot.lights)
    lights[index] = replace(lights[index], **values)
    return replace(snapshot, lights=lights)


def with_material(snapshot: SceneSnapshot, index: int, **values) -> SceneSnapshot:
    """Material ``index`` with other ``values``."""
    materials = list(snapshot.materials)
    materials[index] = replace(materials[index], **values)
    return replace(snapshot, materials=materials)


def with_moved(snapshot: SceneSnapshot, index: int, offset=(0.5, 0.0, 0.0)) -> SceneSnapshot:
    """Object ``index``, which shares its vertices with no other, moved by ``offset`` metres."""
    vertices = snapshot.vertices.copy()
    vertices[np.unique(snapshot.triangles[snapshot.object_index == index])] += offset
    return replace(snapshot, vertices=vertices)
