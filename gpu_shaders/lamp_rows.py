# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps as shaders read them: see direct_light_lib.glsl."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.light_profiles import LightProfile
from ..core.snapshot import Light

_POINT, _SPOT, _SUN, _RECTANGLE, _ELLIPSE = range(5)


def pack_lights(lights: list[Light], origin: np.ndarray) -> np.ndarray:
    """(lights, 6, 4) rows of direct_light_lib's lights, positions relative to ``origin``."""
    rows = np.zeros((len(lights), 6, 4), np.float32)
    for row, light in zip(rows, lights):
        matrix = np.asarray(light.matrix, float)
        row[0, :3] = matrix[:3, 3] - origin
        row[1, :3] = light.color
        row[2, :3], row[3, :3], row[4, :3] = matrix[:3, 0], matrix[:3, 1], matrix[:3, 2]
        row[4, 3] = light.casts_shadow
        if light.kind == "SUN":
            row[0, 3] = _SUN
            row[1, 3] = 1 - np.cos(light.angle / 2)
        elif light.kind == "AREA":
            row[0, 3] = _ELLIPSE if light.shape == "ELLIPSE" else _RECTANGLE
            row[2, 3], row[3, 3] = light.size_x, light.size_y
            if light.spread < np.pi - 1e-4:
                half = max(light.spread / 2, 1e-3)
                row[5, :2] = np.tan(half), 1 / (np.tan(half) - half)
        else:
            row[0, 3] = _SPOT if light.kind == "SPOT" else _POINT
            row[1, 3] = light.radius
            row[5, 2] = light.soft_falloff
            if light.kind == "SPOT":
                row[2, 3], row[3, 3] = (
                    light.spot_scale[2] / light.spot_scale[0],
                    light.spot_scale[2] / light.spot_scale[1],
                )
                cosine = np.cos(light.spot_size / 2)
                row[5, :2] = cosine, 1 / max((1 - cosine) * light.spot_blend, 1e-6)
    return rows


def with_profiles(rows: np.ndarray, profiles: Sequence[LightProfile | None]) -> np.ndarray:
    """(N, 4) elements of direct_light_lib's lights: ``rows`` (lights, 6, 4), with what nodes make of the light of the
    first of them after all."""
    rows = rows.copy()
    end, parts = 6 * len(rows), []
    for row, profile in zip(rows, profiles):
        if profile is not None:
            row[5, 3] = end
            parts.append(profile.rows())
            end += len(parts[-1])
    return np.concatenate([rows.reshape(-1, 4), *parts])
