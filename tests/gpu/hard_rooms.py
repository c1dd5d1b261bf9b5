# SPDX-License-Identifier: GPL-3.0-or-later
"""One room, lit by one lamp, for hard cases: each changes something about it and knows what must come out."""

import numpy as np
from gridlight.core import lookup
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material
from small_scenes import AXES, bake, box, frame, snapshot_of

HALF = np.array([2.0, 1.5, 1.25])  # half size of the inside, metres
WALL = 0.2
SMALL = BakeSettings(face=8)
GREY = Material("grey", (0.7, 0.7, 0.7))
LAMP = Light("lamp", "POINT", (5.0, 4.0, 3.0), frame((0.31, 0.47, 0.7)))


def walls(half=HALF, thickness=WALL):
    """(72, 3, 3) triangles of six slabs that overlap nowhere, normals outwards; 12 each."""
    x, y, z = half
    t = thickness
    slabs = (
        ((-x - t, -y - t, -z - t), (x + t, y + t, -z)),
        ((-x - t, -y - t, z), (x + t, y + t, z + t)),
        ((-x - t, y, -z), (x + t, y + t, z)),
        ((-x - t, -y - t, -z), (x + t, -y, z)),
        ((-x - t, -y, -z), (-x, y, z)),
        ((x, -y, -z), (x + t, y, z)),
    )
    return np.concatenate([box(*slab) for slab in slabs])


def room(corners=None, extra=(), lights=(LAMP,), materials=(GREY,), **options):
    """The room, or ``corners`` (T, 3, 3) instead of its walls, with ``extra`` triangles, each entry an object."""
    parts = [walls() if corners is None else corners, *extra]
    first = -(-len(parts[0]) // 12)
    objects = [np.arange(len(parts[0])) // 12, *(np.full(len(p), first + i) for i, p in enumerate(extra))]
    return snapshot_of(np.concatenate(parts), None, materials, np.concatenate(objects), lights=list(lights), **options)


def grid(resolution=(4, 4, 3), inset=0.2):
    """A volume ``inset`` metres inside the room's walls."""
    return Grid.from_bounds(inset - HALF, HALF - inset, resolution)


def points(count=60, margin=0.3):
    """(count, 3) places in the room, away from its walls."""
    return np.random.default_rng(0).uniform(margin - HALF, HALF - margin, (count, 3))


def light_at(result, places):
    """(N, 6, 3) irradiance for six normals."""
    found = lookup.irradiance(result.field, np.repeat(places, 6, axis=0), np.tile(AXES, (len(places), 1)))
    return found.reshape(len(places), 6, 3)


def difference(found, expected):
    """Relative RMS."""
    return np.sqrt(((found - expected) ** 2).mean() / (expected**2).mean())


def bake_room(grid_=None, settings=SMALL, **options):
    return bake(room(**options), grid_ or grid(), settings)


def check_whole(result):
    """What every bake owes: finite numbers, and every node in exactly one state."""
    field = result.field
    for name in ("coefficients", "validity", "offset", "depth"):
        assert np.isfinite(getattr(field, name)).all(), name
    counts = result.counts
    assert counts["active"] + counts["culled"] + counts["invalid"] == counts["total"] == field.grid.count
    cells = np.linalg.inv(field.grid.matrix)[:3, :3] @ field.offset.T.astype(float)
    spans = np.maximum(np.array(field.grid.resolution) - 1, 1) / 2
    assert (np.abs(cells.T) * spans <= 0.5 + 1e-5).all()
