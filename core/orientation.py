# SPDX-License-Identifier: GPL-3.0-or-later
"""Which objects have their normals the wrong way round.

A room made from a cube primitive is seen from behind by every probe in it, and so is a solid by the probes that are stuck inside; only
the latter are invalid. The probes vote: an object that most of the probes seeing it see from behind is taken as inside out, and what
they see of it counts as front faces.
"""

from __future__ import annotations

import numpy as np


def flipped_objects(sightings: np.ndarray, object_count: int) -> np.ndarray:
    """(object_count,) bool from ``sightings`` (P, S): per probe, ±(object + 1) of S directions, negative from behind, 0 nothing."""
    sightings = np.asarray(sightings, np.int64)
    probe = np.broadcast_to(np.arange(len(sightings))[:, None], sightings.shape)
    seen = sightings != 0
    pair = probe[seen] * object_count + np.abs(sightings[seen]) - 1
    pairs, inverse = np.unique(pair, return_inverse=True)
    sides = np.bincount(inverse, np.sign(sightings[seen]), len(pairs))
    votes = np.bincount(pairs % object_count, np.sign(sides), object_count)
    return votes < 0
