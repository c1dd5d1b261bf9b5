# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's camera as plain numbers, for pictures."""

from __future__ import annotations

import math

import bpy
import numpy as np

from ..core.camera import Camera


def read_camera(scene: bpy.types.Scene, aspect: float = 16 / 9) -> Camera | None:
    """Camera of ``scene`` for an image of ``aspect``; None where there is none or it is a panorama.

    The horizontal field of view is kept, the height follows from the aspect.
    """
    object_ = scene.camera
    if object_ is None or object_.type != "CAMERA" or object_.data.type == "PANO":
        return None
    matrix = np.array(object_.matrix_world.normalized(), float)
    orthographic = object_.data.type == "ORTHO"
    half_width = object_.data.ortho_scale / 2 if orthographic else math.tan(object_.data.angle_x / 2)
    return Camera(
        matrix[:3, 3], matrix[:3, 0] * half_width, matrix[:3, 1] * half_width / aspect, -matrix[:3, 2], orthographic
    )
