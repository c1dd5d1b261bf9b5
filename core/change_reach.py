# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probes, and which shadows, a change of shape can reach. Conservative: what is not reached is as it was.

Everything is decided with boxes around what changed (core/scene_changes.py) and the distances that a capture kept; no
ray is traced. A texel can see the change only if

* what it hit lay in an old box: it may have hit what is gone, or
* its ray enters a new box no later than its hit: something may stand in the way now.

Boxes grow by what rounding can move a hit, and by ``spread``: rasterised hits are up to a 256th of a pixel aside.

A shadow can change only if the way from the surface to some point of the light crosses an old or a new box. All ways
from a point x to a ball of radius r around c lie in the cone x + t·(c − x + r·u), |u| ≤ 1, 0 ≤ t ≤ 1, whose bounds
along an axis are linear in t; so the cone is clipped against a box like a ray, with two slopes an axis.

P probes, X texels, K boxes, N points; positions in metres, relative to any one origin.
"""

from __future__ import annotations

import numpy as np

from .snapshot import Light

ROUNDING = 1e-5  # of the largest coordinate: what float32 may move a hit, or the edge of a triangle
RASTER_SPREAD = (
    2.0 / 256
)  # of a texel: rasterisers snap corners to 1/256 of a pixel; twice that for both ends of an edge
_FAR = 1e30


def grown(boxes: np.ndarray, positions: np.ndarray, spread: float = 0.0) -> np.ndarray:
    """``boxes`` (K, 2, 3) enlarged by rounding, and by an angle of ``spread`` radians as seen from the farthest of
    ``positions`` (P, 3)."""
    if not len(boxes):
        return boxes
    corner = np.abs(boxes).max(axis=(1, 2))
    place = np.abs(positions).max(initial=0.0)
    margin = ROUNDING * np.maximum(corner, place) + spread * np.sqrt(3.0) * (corner + place)
    return boxes + np.array([-1.0, 1.0])[None, :, None] * margin[:, None, None]


def probes_that_see(
    positions: np.ndarray, directions: np.ndarray, distances: np.ndarray, old_boxes: np.ndarray, new_boxes: np.ndarray
) -> np.ndarray:
    """(P,) bool of probes that must be captured again.

    Args:
        positions: (P, 3).
        directions: (X, 3) of the texels, unit length.
        distances: (P, X) captured, infinite for background.
        old_boxes, new_boxes: (K, 2, 3), already ``grown``.
    """
    seen = np.zeros(len(positions), bool)
    reach = np.minimum(distances, _FAR)
    for boxes, old in ((old_boxes, True), (new_boxes, False)):
        for box in boxes:
            enter, leave = _clip(box, positions[:, None], directions[None], directions[None])
            met = (enter <= leave) & (enter <= reach * (1 + ROUNDING))
            if old:
                met &= leave >= reach * (1 - ROUNDING)
            seen |= met.any(axis=1)
    return seen


def light_cone(light: Light, origin: np.ndarray) -> np.ndarray:
    """(5,) x, y, z, radius, kind of what ``light`` shines from, relative to ``origin`` (3,): a ball around it (kind
    1), or for suns the direction towards it and the tangent of half its angle (kind 0)."""
    if light.kind == "SUN":
        half = min(light.angle / 2, np.pi / 2 - 1e-6)
        return np.array([*np.asarray(light.matrix, float)[:3, 2], np.tan(half), 0.0])
    radius = np.hypot(light.size_x, light.size_y) / 2 if light.kind == "AREA" else light.radius
    return np.array([*(np.asarray(light.matrix, float)[:3, 3] - origin), radius, 1.0])


def shadows_that_change(points: np.ndarray, cones: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """(N,) bool: may the way from ``points`` (N, 3) to one of the lights ``cones`` (L, 5) cross one of ``boxes`` (K, 2,
    3)?"""
    found = np.zeros(len(points), bool)
    for x, y, z, radius, is_ball in cones:
        target = np.array([x, y, z])
        way = target - points if is_ball else np.broadcast_to(target, points.shape)
        for box in boxes:
            enter, leave = _clip(box, points, way - radius, way + radius)
            found |= enter <= np.minimum(leave, 1.0 if is_ball else _FAR)
    return found


def _clip(box: np.ndarray, origins: np.ndarray, least: np.ndarray, most: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Interval of t ≥ 0 in which [o + t·least, o + t·most] meets [low, high] on every axis; empty where enter > leave.

    Shapes broadcast. With ``least`` = ``most`` this is a ray against a box.
    """
    low, high = box
    enter, leave = np.zeros(1), np.full(1, _FAR)
    # o + t·most ≥ low and o + t·least ≤ high, each a half line of t
    for distance, slope in ((low - origins, most), (origins - high, -least)):
        with np.errstate(divide="ignore", invalid="ignore"):
            t = distance / slope
        begins = np.where(slope > 0, t, np.where((slope == 0) & (distance > 0), _FAR, 0.0))
        ends = np.where(slope < 0, t, np.where((slope == 0) & (distance > 0), -1.0, _FAR))
        enter = np.maximum(enter, begins.max(axis=-1))
        leave = np.minimum(leave, ends.min(axis=-1))
    return enter, leave
