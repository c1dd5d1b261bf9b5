# SPDX-License-Identifier: GPL-3.0-or-later
"""The building of the demo gallery: its plan, its shell and what is fixed to it.

A vaulted hall between two wings, each with a room below and a loggia above that opens to the hall::

    section, looking north (+y)                               plan
        _______                 _______                          +-----------+
       |       +---------------+       |  roof          +--------+           +--------+
       | ochre    )  vault  (    green |  z = 7.7       |                             |
       | loggia |               | loggia|               | crimson      hall      teal |
       +--------+               +---@---+ z = 3.6       |                          @  |  @ spiral stair
       | crimson      hall        teal  |               +--------+           +--------+
       +--------------------------------+ z = 0                  +-----------+

The probe volume spans all of it: 11 × 4 × 7 nodes over 22 m × 5.4 m × 7.2 m, cells of 2.2 m × 1.8 m × 1.2 m. The hall
is wider than the wings by more than half a cell on both sides, so between the sculptures below z = 2.7 and the cornice
above z = 5.1 its air is free of surface: the three columns of nodes there at z = 3.9 light nothing, and neither does
one more at z = 2.7 that stands where the south wall has no lamp. Culling finds these 13 of the 308 by itself.
"""

from __future__ import annotations

import numpy as np

from .gallery_shapes import (
    Solid,
    arch_filling,
    arch_frame,
    balustrade,
    box,
    carved,
    coffered_vault,
    ring_moulding,
    spiral_stair,
)

VOLUME_LOW, VOLUME_HIGH = (-11.0, -2.7, 0.3), (11.0, 2.7, 7.5)
VOLUME_RESOLUTION = (11, 4, 7)

HALL_X, HALL_Y, HALL_TOP = 4.7, 3.8, 9.2
WING_X0, WING_X1, WING_Y = 5.0, 11.2, 2.85  # mirrored for the west wing
ROOM_TOP, LOGGIA_FLOOR, LOGGIA_TOP = 3.3, 3.6, 7.7
DOOR_HALF, DOOR_SPRING, DOOR_RISE, DOOR_TOP = 1.3, 2.15, 0.7, 3.0
ARCH_HALF, ARCH_SPRING, ARCH_RISE, ARCH_TOP = 1.9, 4.75, 0.6, 5.45
CORNICE_FOOT, VAULT_SPRING, VAULT_RISE = 5.58, 6.17, 2.43
STAIR_AT, STAIR_RADIUS = (10.1, 1.8), 0.95
STAIR_WELL = (9.1, 0.8), (11.1, 2.8)


def shell() -> Solid:
    """Walls, floors and roofs as one closed solid."""
    outer = [((-5.0, -4.1, -0.3), (5.0, 4.1, 9.5))]
    rooms = [((-HALL_X, -HALL_Y, 0), (HALL_X, HALL_Y, HALL_TOP), "Plaster", "Stone tiles", "Ceiling")]
    for side, low_wall, high_wall in ((-1, "Crimson wall", "Ochre wall"), (1, "Teal wall", "Green wall")):
        outer.append((*_ordered((side * 5.0, -3.15, -0.3), (side * 11.5, 3.15, 8.0)),))
        rooms.append(
            (
                *_ordered((side * WING_X0, -WING_Y, 0), (side * WING_X1, WING_Y, ROOM_TOP)),
                low_wall,
                "Oak parquet",
                "Ceiling",
            )
        )
        rooms.append(
            (
                *_ordered((side * WING_X0, -WING_Y, LOGGIA_FLOOR), (side * WING_X1, WING_Y, LOGGIA_TOP)),
                high_wall,
                "Oak parquet",
                "Ceiling",
            )
        )
        rooms.append(
            (
                *_ordered((side * HALL_X, -DOOR_HALF, 0), (side * WING_X0, DOOR_HALF, DOOR_TOP)),
                "Limestone",
                "Limestone",
                "Limestone",
            )
        )
        rooms.append(
            (
                *_ordered((side * HALL_X, -ARCH_HALF, LOGGIA_FLOOR), (side * WING_X0, ARCH_HALF, ARCH_TOP)),
                "Limestone",
                "Limestone",
                "Limestone",
            )
        )
    (x0, y0), (x1, y1) = STAIR_WELL
    rooms.append(((x0, y0, ROOM_TOP), (x1, y1, LOGGIA_FLOOR), "Ceiling", "Ceiling", "Ceiling"))
    return carved(outer, rooms, "Exterior")


def arches() -> Solid:
    """The four arched heads and their stone frames."""
    parts = []
    for side, low_wall, high_wall in ((-1, "Crimson wall", "Ochre wall"), (1, "Teal wall", "Green wall")):
        x0, x1 = sorted((side * HALL_X, side * WING_X0))
        for half, spring, rise, top, foot, wall in (
            (DOOR_HALF, DOOR_SPRING, DOOR_RISE, DOOR_TOP, 0.0, low_wall),
            (ARCH_HALF, ARCH_SPRING, ARCH_RISE, ARCH_TOP, LOGGIA_FLOOR, high_wall),
        ):
            faces = (wall, "Plaster") if side < 0 else ("Plaster", wall)
            parts.append(arch_filling(x0, x1, half, spring, rise, top, (*faces, "Limestone")))
            parts.append(arch_frame(x0 - 0.05, x0, half, foot, spring, rise, 0.16, "Limestone"))
            parts.append(arch_frame(x1, x1 + 0.05, half, foot, spring, rise, 0.16, "Limestone"))
    return _joined(parts)


def vault() -> Solid:
    """The coffered barrel vault over the hall."""
    return coffered_vault(-HALL_X, HALL_X, HALL_Y, VAULT_SPRING, VAULT_RISE, HALL_TOP, (9, 7), ("Ceiling", "Coffer"))


def cornice() -> Solid:
    """The hall's cornice, hollowed on top for the cove light."""
    foot, top = CORNICE_FOOT, VAULT_SPRING
    profile = [
        (0, foot),
        (0.06, foot),
        (0.08, foot + 0.08),
        (0.16, foot + 0.16),
        (0.18, foot + 0.3),
        (0.30, foot + 0.38),
        (0.34, foot + 0.46),
        (0.34, top - 0.02),
        (0.29, top - 0.02),
        (0.29, top - 0.14),
        (0, top - 0.14),
    ]
    return ring_moulding((-HALL_X, -HALL_Y), (HALL_X, HALL_Y), profile, "Ceiling")


def cove_lights() -> Solid:
    """Two glowing strips that lie in the hall's cornice and wash the vault."""
    x, z = HALL_X - 0.4, VAULT_SPRING - 0.14
    near, far = HALL_Y - 0.25, HALL_Y - 0.05
    return box((-x, near, z), (x, far, z + 0.03), "Cove glow") + box((-x, -far, z), (x, -near, z + 0.03), "Cove glow")


def trim() -> Solid:
    """Skirting and picture rails of all rooms."""
    door = ((-DOOR_HALF - 0.16, DOOR_HALF + 0.16),)
    parts = [_along_walls((-HALL_X, -HALL_Y), (HALL_X, HALL_Y), (0, 0.18), 0.025, "Limestone", door, door)]
    for side in (-1, 1):
        low, high = _ordered((side * WING_X0, -WING_Y), (side * WING_X1, WING_Y))
        arch = ((-ARCH_HALF - 0.16, ARCH_HALF + 0.16),)
        west, east = ((), door) if side < 0 else (door, ())
        parts.append(_along_walls(low, high, (0, 0.14), 0.02, "Walnut", west, east))
        parts.append(_along_walls(low, high, (2.86, 2.92), 0.035, "Walnut", west, east))
        west, east = ((), arch) if side < 0 else (arch, ())
        parts.append(_along_walls(low, high, (LOGGIA_FLOOR, LOGGIA_FLOOR + 0.14), 0.02, "Walnut", west, east))
        profile = [
            (0, LOGGIA_TOP - 0.3),
            (0.05, LOGGIA_TOP - 0.3),
            (0.08, LOGGIA_TOP - 0.18),
            (0.22, LOGGIA_TOP - 0.06),
            (0.22, LOGGIA_TOP),
            (0, LOGGIA_TOP),
        ]
        parts.append(ring_moulding(low, high, profile, "Ceiling"))
    return _joined(parts)


def railings() -> Solid:
    """Balustrades of the loggias and around the stair well."""
    middle = (HALL_X + WING_X0) / 2
    parts = [
        balustrade((side * middle, -ARCH_HALF), (side * middle, ARCH_HALF), LOGGIA_FLOOR, 1.0, "Limestone", 0.3)
        for side in (-1, 1)
    ]
    (x0, y0), (x1, y1) = STAIR_WELL
    parts.append(balustrade((x0 - 0.08, y0), (x0 - 0.08, y1), LOGGIA_FLOOR, 0.95, "Walnut"))
    parts.append(balustrade((x0, y0 - 0.08), (x0 + 1.1, y0 - 0.08), LOGGIA_FLOOR, 0.95, "Walnut"))
    return _joined(parts)


def stair() -> Solid:
    """The spiral stair from the teal room to the green loggia."""
    turn = np.radians(-47)
    return spiral_stair(LOGGIA_FLOOR, 20, np.radians(342), 0.07, STAIR_RADIUS, "Walnut", "Iron").at(*STAIR_AT, 0, turn)


def _ordered(a, b) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The two corners of a box as (lowest, highest)."""
    return tuple(np.minimum(a, b).tolist()), tuple(np.maximum(a, b).tolist())


def _joined(parts: list[Solid]) -> Solid:
    total = parts[0]
    for part in parts[1:]:
        total = total + part
    return total


def _along_walls(low, high, heights, depth: float, material: str, west_gaps, east_gaps) -> Solid:
    """Battens along the four walls of a room; the gaps are (y0, y1) openings in its west and east walls."""
    (x0, y0), (x1, y1), (z0, z1) = low, high, heights
    parts = [box((x0, y0, z0), (x1, y0 + depth, z1), material), box((x0, y1 - depth, z0), (x1, y1, z1), material)]
    for gaps, near, far in ((west_gaps, x0, x0 + depth), (east_gaps, x1 - depth, x1)):
        edges = [y0 + depth, *(edge for gap in gaps for edge in gap), y1 - depth]
        parts += [box((near, start, z0), (far, end, z1), material) for start, end in zip(edges[::2], edges[1::2])]
    return _joined(parts)
