# SPDX-License-Identifier: GPL-3.0-or-later
"""From where a picture is taken."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .conventions import ACTIVE, DEPTH_EDGE, LUMINANCE
from .cubemap import octahedral_decode
from .field import Field


@dataclass(frozen=True)
class Camera:
    """World position and the axes of the image.

    ``right`` and ``up`` reach from the image's centre to its edges at distance 1 along the unit vector ``forward``;
    for an orthographic camera they are half the image's size in metres.
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
    """A view for scenes without a camera: from an active probe that is well lit and sees far towards the volume's
    centre.

    Depth statistics and light of the field are all it asks. A place near the edge of the volume, at half its height,
    under a roof rather than under the sky, is preferred: there one stands in a room and overlooks it.
    """
    active = np.flatnonzero(field.state == ACTIVE)
    texel = (np.indices((DEPTH_EDGE, DEPTH_EDGE))[::-1].reshape(2, -1).T + 0.5) * 2 / DEPTH_EDGE - 1
    directions = octahedral_decode(texel)
    positions = field.grid.positions()[active]
    toward = field.grid.center - positions
    height = np.abs(toward[:, 2])
    toward[:, 2] = 0
    length = np.linalg.norm(toward, axis=1, keepdims=True)
    toward = np.where(length > 1e-9, toward / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
    depth = field.depth[active, :, 0]
    lobe = np.maximum(toward @ directions.T, 0.0) ** 8
    ahead = (lobe * depth).sum(axis=1) / lobe.sum(axis=1)
    above = depth[:, directions[:, 2] > 0.7].mean(axis=1)
    light = field.coefficients[active, 0] @ LUMINANCE
    score = (
        _share(ahead)
        - 0.5 * _share(above)
        + 0.3 * _share(length[:, 0])
        - 0.5 * _share(height)
        + np.minimum(light / max(np.percentile(light, 75), 1e-30), 1.0)
    )
    best = int(np.argmax(score))
    return look(positions[best], positions[best] + toward[best] - [0, 0, 0.08], aspect, half_angle=0.8)


def _share(values: np.ndarray) -> np.ndarray:
    """``values`` as shares of their greatest."""
    return values / max(values.max(), 1e-30)
