# SPDX-License-Identifier: GPL-3.0-or-later
"""Suns in an environment map, taken out of it and made lamps.

A sun of a few pixels holds most of a sky's light, and rays that leave a surface at random would find it once in ten
thousand. What stands far out of the map is therefore sampled like a sun lamp of the same direction, size and
irradiance, by patches and by probes; rays and texels see the rest.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .conventions import LUMINANCE
from .panorama import panorama_directions, panorama_solid_angles
from .snapshot import Light, World

_PEAK = 16.0  # times the map's mean: what is brighter may be a sun
# From its brightest pixel, what belongs to a sun: discs with their glow, veiled ones, soft boxes.
_REACHES = np.radians([4.0, 8.0, 16.0])
# What is bright twice as far away, too, is a bright part of the sky, which rays find.
_MOST_AROUND = 0.2
_MOST_SUNS = 8
PROBE_RAYS = 64  # that a probe sends to each sun


def extract_suns(world: World) -> tuple[World, list[Light]]:
    """The world without its suns, and the suns as lamps. Together they send what ``world`` sends, to rounding.

    A lamp's colour is the irradiance on a surface that faces it. Its disc is as large as the sun's bright part: the
    solid angle (∫L)²/∫L².
    """
    if world.map is None:
        return world, []
    height, width = world.map.shape[:2]
    solid_angles = panorama_solid_angles(width, height).ravel()
    radiance = np.asarray(world.map, float).reshape(-1, 3)
    luminance = radiance @ LUMINANCE
    mean = float(luminance @ solid_angles) / (4 * np.pi)
    bright = np.flatnonzero(luminance > _PEAK * mean)
    if not len(bright) or mean <= 0:
        return world, []
    directions = panorama_directions(width, height).reshape(-1, 3)[bright]
    excess = radiance[bright] * (1 - mean / luminance[bright])[:, None]
    power = excess @ LUMINANCE
    free, taken = np.ones(len(bright), bool), np.zeros(len(bright), bool)  # may be looked at; belong to a sun
    rest = radiance.copy()
    suns: list[Light] = []
    while free.any() and len(suns) < _MOST_SUNS:
        brightest = int(np.argmax(np.where(free, power, -1.0)))
        cosine = directions @ directions[brightest]
        omega = solid_angles[bright]
        for reach in _REACHES:
            member = np.flatnonzero(free & (cosine >= np.cos(reach)))
            around = np.flatnonzero(~taken & (cosine < np.cos(reach)) & (cosine >= np.cos(2 * reach)))
            stands_out = power[around] @ omega[around] <= _MOST_AROUND * (power[member] @ omega[member])
            if stands_out:
                break
        if not stands_out:
            free[np.concatenate([member, around])] = False
            continue
        free[member], taken[member] = False, True
        omega = omega[member]
        rest[bright[member]] -= excess[member]
        suns.append(_lamp(f"sun {len(suns) + 1} of the world", directions[member], excess[member], omega))
    if not suns:
        return world, []
    return replace(world, map=rest.reshape(world.map.shape).astype(np.float32)), suns


def _lamp(name: str, directions: np.ndarray, radiance: np.ndarray, solid_angles: np.ndarray) -> Light:
    """A sun lamp for pixels (N, 3) of ``radiance`` (N, 3) in ``directions`` (N, 3)."""
    flux = (radiance @ LUMINANCE) * solid_angles
    back = flux @ directions
    back /= np.linalg.norm(back)
    size = flux.sum() ** 2 / ((radiance @ LUMINANCE) ** 2 * solid_angles).sum()
    matrix = np.eye(4)
    side = np.cross(back, np.eye(3)[np.argmin(np.abs(back))])
    matrix[:3, 0] = side / np.linalg.norm(side)
    matrix[:3, 1] = np.cross(back, matrix[:3, 0])
    matrix[:3, 2] = back
    angle = 2 * np.arccos(1 - size / (2 * np.pi))
    return Light(name, "SUN", tuple((solid_angles @ radiance).tolist()), matrix, angle=float(angle))
