# SPDX-License-Identifier: GPL-3.0-or-later
"""From where a picture is taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .conventions import ACTIVE, DEPTH_EDGE
from .cubemap import octahedral_decode
from .field import Field


@dataclass(frozen=True)
class Camera:
    """World position and the axes of the image.

    ``right`` and ``up`` reach from the image's centre to its edges at distance 1 along the unit vector ``forward``; for an orthographic
    camera they are half the image's size in metres.
    """

    position: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    orthographic: bool = False


def look(position, target, aspect: float, half_angle: float = 0.6) -> Camera:
    """Upright perspective camera at ``position`` that looks at ``target``; ``half_angle`` is horizontal, radians."""
    position = np.asarray(position, float)
    forward = np.asarray(target, float) - position
    forward /= np.linalg.norm(forward)
    helper = np.array([0.0, 0.0, 1.0]) if abs(forward[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(forward, helper)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    width = np.tan(half_angle)
    return Camera(position, right * width, up * width / aspect, forward)


def suggest(field: Field, aspect: float) -> Camera:
    """A view for scenes without a camera: from the active probe that sees farthest horizontally, along that view.

    Only the depth statistics are asked, so the answer is a place in free space that overlooks as much as a cell's surroundings tell.
    """
    active = np.flatnonzero(field.state == ACTIVE)
    texel = (np.indices((DEPTH_EDGE, DEPTH_EDGE))[::-1].reshape(2, -1).T + 0.5) * 2 / DEPTH_EDGE - 1
    directions = octahedral_decode(texel)
    positions = field.grid.positions()[active]
    toward = field.grid.center - positions
    toward[:, 2] = 0
    length = np.linalg.norm(toward, axis=1, keepdims=True)
    toward = np.where(length > 1e-9, toward / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
    lobe = np.maximum(toward @ directions.T, 0.0) ** 8
    openness = (lobe * field.depth[active, :, 0]).sum(axis=1) / lobe.sum(axis=1)
    # far from the centre, not at the floor or the ceiling, with free sight
    height = positions[:, 2] - field.grid.center[2]
    score = openness / max(openness.max(), 1e-9) + 0.5 * length[:, 0] / max(length.max(), 1e-9)
    score -= np.abs(height) / max(np.abs(height).max(), 1e-9)
    best = int(np.argmax(score))
    return look(positions[best], positions[best] + toward[best] - [0, 0, 0.08], aspect, half_angle=0.8)
