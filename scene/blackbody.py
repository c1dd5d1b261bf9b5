# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of black bodies as Blender itself gives them."""

from __future__ import annotations

import bpy
import numpy as np


def blackbody_color(kelvin: float) -> np.ndarray:
    """(3,) linear Rec. 709 colour of a black body with luminance 1, by Blender itself through a light's temperature."""
    light = bpy.data.lights.new("Gridlight Temperature", "POINT")
    try:
        light.use_temperature = True
        light.temperature = kelvin
        return np.array(light.temperature_color, float)
    finally:
        bpy.data.lights.remove(light)
