# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probes a change of shape can reach. Conservative: what is not reached sees what it saw.

Decided with boxes around what changed (core/scene_changes.py) and the distances that a capture kept; no ray is traced.
A texel can see the change only if

* what it hit lay in an old box: it may have hit what is gone, or
* its ray enters a new box no later than its hit: something may stand in the way now.

Boxes grow by what rounding can move a hit, and by ``spread``: rasterised hits are up to a 256th of a pixel aside.

Readable twin of gpu_shaders/glsl/probe_reach_comp.glsl. P probes, X texels, K boxes; positions in metres, relative to
any one origin.
"""

from __future__ import annotations

import numpy as np

ROUNDING = 1e-5  # of the largest coordinate: what float32 may move a hit, or the edge of a triangle
RASTER_SPREAD = 2.0 / 256  # of a texel: rasterisers snap both ends of an edge to 1/256 of a pixel
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
            enter, leave = _clip(box, positions[:, None], directions[None])
            met = (enter <= leave) & (enter <= reach * (1 + ROUNDING))
            if old:
                met &= leave >= reach * (1 - ROUNDING)
            seen |= met.any(axis=1)
    return seen


def _clip(box: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where rays (…, 3) enter and leave ``box`` (2, 3), from 0 on; enter > leave where they miss it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        planes = (box.reshape(2, *(1,) * (origins.ndim - 1), 3) - origins) / directions
    along = directions == 0  # never crosses these planes: within them all the way, or never
    within = (origins >= box[0]) & (origins <= box[1])
    enter = np.where(along, np.where(within, 0.0, _FAR), planes.min(axis=0))
    leave = np.where(along, np.where(within, _FAR, -1.0), planes.max(axis=0))
    return np.maximum(enter.max(axis=-1), 0.0), leave.min(axis=-1)
