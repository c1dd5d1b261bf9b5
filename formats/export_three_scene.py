# SPDX-License-Identifier: GPL-3.0-or-later
"""What the three.js viewer shows beside the probes and the GLB: lamps, camera, exposure and background of the scene.

glTF knows no area lights and counts the others in lumens, so lamps travel here, in Gridlight's own units: intensity
W/sr, irradiance W/m² for suns. three.js computes with them as they are.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.panorama import panorama_solid_angles
from ..core.snapshot import Light, SceneSnapshot

_WIDEST = 1.3  # rad; half the cone of the spot that stands in for an area light: what a shadow map can hold


def describe(snapshot: SceneSnapshot, axes: np.ndarray, model: str) -> dict:
    """The content of scene.json in the GLB's ``axes`` (3, 3), metres; ``model`` is the GLB's name."""
    low, high = snapshot.bounds()
    camera = snapshot.camera
    view = None
    if camera is not None and not camera.orthographic:
        view = {
            "position": (axes @ camera.position).tolist(),
            "forward": (axes @ camera.forward).tolist(),
            "half_width": float(np.linalg.norm(camera.right)),
        }
    return {
        "format": "gridlight-three-scene",
        "version": 1,
        "model": model,
        "radius": float(np.linalg.norm(high - low)),
        "background": _background(snapshot).tolist(),
        "exposure": snapshot.exposure,
        "camera": view,
        "lamps": [_lamp(light, axes) for light in snapshot.lights],
    }


def _lamp(light: Light, axes: np.ndarray) -> dict:
    color = np.array(light.color)
    lamp = {"kind": light.kind.lower(), "name": light.name, "shadow": light.casts_shadow}
    if light.kind == "AREA":
        area = light.size_x * light.size_y * (math.pi / 4 if light.shape == "ELLIPSE" else 1)
        color = color * area  # what a flat lamp sends along its axis
        lamp.update(kind="spot", stands_in_for="area", angle=min(_WIDEST, light.spread / 2), blend=1.0)
    elif light.kind == "SPOT":
        lamp.update(angle=light.spot_size / 2, blend=light.spot_blend)
    return {
        **lamp,
        "color": color.tolist(),
        "position": (axes @ light.matrix[:3, 3]).tolist(),
        "direction": (axes @ -light.matrix[:3, 2]).tolist(),
    }


def _background(snapshot: SceneSnapshot) -> np.ndarray:
    """(3,) radiance of the world; the mean of one that varies."""
    if snapshot.world.map is None:
        return np.array(snapshot.world.color)
    height, width = snapshot.world.map.shape[:2]
    return np.tensordot(panorama_solid_angles(width, height), snapshot.world.map.astype(float), 2) / (4 * math.pi)
