# SPDX-License-Identifier: GPL-3.0-or-later
"""Animated things that somebody changed by hand without a keyframe.

Blender keeps such a change until it evaluates the animation again, which a change of the frame does and every render;
reading a scene as a render sees it does so too. Users are told, for a lamp that jumps back looks like a fault.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..scene.lights import is_animated

_LIGHT_VALUES = ("energy", "color")


def animated_states(scene: bpy.types.Scene) -> dict[str, np.ndarray]:
    """Where animated objects of ``scene`` stand in their parents, and what lamps among them give; by name."""
    return {item.name: _state(item) for item in scene.objects if is_animated(item) or is_animated(item.data)}


def evaluate_animation(scene: bpy.types.Scene) -> None:
    """Has Blender put everything back that ``taken_back`` tells of, the next time it evaluates the scene."""
    for item in scene.objects:
        for block in (item, item.data):
            if is_animated(block):
                block.update_tag(refresh={"TIME"})


def taken_back(scene: bpy.types.Scene, before: dict[str, np.ndarray]) -> list[str]:
    """A line for each object whose state of ``before`` its animation has overruled since."""
    return [
        f"'{name}' is animated and was changed by hand without a keyframe: like a render, the bake has put it back to "
        "where its animation has it. Insert a keyframe (I) to keep a change"
        for name, state in animated_states(scene).items()
        if name in before and not np.array_equal(before[name], state)
    ]


def _state(item: bpy.types.Object) -> np.ndarray:
    values = [np.array(item.matrix_basis).ravel()]
    if item.type == "LIGHT":
        values += [np.ravel(getattr(item.data, name)) for name in _LIGHT_VALUES]
    return np.concatenate(values)
