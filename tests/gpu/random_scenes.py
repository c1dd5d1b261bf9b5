# SPDX-License-Identifier: GPL-3.0-or-later
"""Random scenes for invariants: rooms of every make with things, lamps and probes where nobody would put them."""

from dataclasses import dataclass, replace

import numpy as np
from gridlight.core.grid import Grid
from gridlight.core.snapshot import Light, Material, World
from hypothesis import strategies as st
from small_scenes import box, frame, snapshot_of

WALLS = ("slabs", "cube", "cube inside out", "planes", "no ceiling", "ground")
LAMPS = ("POINT", "SPOT", "SUN", "AREA")
VOLUMES = ("inside", "on the walls", "into the walls", "beyond", "turned", "sheared", "mirrored", "flat", "single")
ROOM = np.array([1.5, 1.2, 1.0])  # half size, metres


@dataclass(frozen=True)
class Spec:
    """What a scene is made of; ``seed`` decides the rest."""

    seed: int
    walls: str
    things: int
    lamps: tuple[str, ...]
    glowing: bool
    sky: bool
    volume: str

    def build(self):
        """(snapshot, grid)"""
        random = np.random.default_rng(self.seed)
        parts = _walls(self.walls)
        first_thing = len(parts)
        parts += [_thing(random) for _ in range(self.things)]
        lengths = [len(part) for part in parts]
        albedo = random.uniform(0.1, 0.8, (len(parts), 3))
        materials = [Material(f"wall {i}", tuple(color)) for i, color in enumerate(albedo)]
        if self.glowing and self.things:
            materials[first_thing] = replace(materials[first_thing], emission=tuple(random.uniform(0.5, 3.0, 3)))
        lamps = [_lamp(kind, random) for kind in self.lamps]
        index = np.repeat(np.arange(len(parts)), lengths)
        snapshot = snapshot_of(
            np.concatenate(parts),
            index,
            materials,
            index,
            lights=lamps,
            world=World(tuple(random.uniform(0.1, 1.0, 3))) if self.sky else World(),
        )
        return snapshot, _grid(self.volume, random)


def specs():
    """Scenes with at least one source of light that can be scaled."""
    return st.builds(
        Spec,
        seed=st.integers(0, 2**31 - 1),
        walls=st.sampled_from(WALLS),
        things=st.integers(0, 4),
        lamps=st.lists(st.sampled_from(LAMPS), min_size=1, max_size=3).map(tuple),
        glowing=st.booleans(),
        sky=st.booleans(),
        volume=st.sampled_from(VOLUMES),
    )


def _walls(kind):
    """Triangles of each wall, which is an object and a material of its own."""
    x, y, z = ROOM
    if kind.startswith("cube"):
        corners = box(-ROOM, ROOM)
        return [corners if kind == "cube" else corners[:, ::-1]]
    if kind == "ground":
        return [8 * box((-1, -1, -1), (1, 1, -0.5)) * [1, 1, 0.25] - [0, 0, z - 1.0]]
    t = 0.15
    slabs = [
        box((-x - t, -y - t, -z - t), (x + t, y + t, -z)),
        box((-x - t, y, -z), (x + t, y + t, z)),
        box((-x - t, -y - t, -z), (x + t, -y, z)),
        box((-x - t, -y, -z), (-x, y, z)),
        box((x, -y, -z), (x + t, y, z)),
        box((-x - t, -y - t, z), (x + t, y + t, z + t)),
    ]
    if kind == "planes":  # of each slab, the face that looks into the room
        return [slab[_looks_inside(slab)] for slab in slabs]
    return slabs[:5] if kind == "no ceiling" else slabs


def _looks_inside(slab):
    middle = slab.mean(axis=1)
    return (np.abs(middle) <= ROOM + 1e-9).all(axis=1)


def _thing(random):
    """A box, turned anyhow, that may stick through walls, or a few loose triangles."""
    place = random.uniform(-1, 1, 3) * ROOM
    if random.random() < 0.3:
        return place + random.normal(0, 0.3, (4, 3, 3))
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    half = random.uniform(0.05, 0.4, 3)
    return box(-half, half) @ turn.T + place


def _lamp(kind, random):
    """Hard lamps only, so that no chance is involved, and at least a hand's breadth from the room's walls."""
    color = tuple(random.uniform(0.5, 2.0, 3))
    at = frame(random.uniform(-1, 1, 3) * (ROOM - 0.15), random.normal(size=3))
    if kind == "SPOT":
        return Light("lamp", kind, color, at, spot_size=float(random.uniform(0.3, 3.0)), spot_blend=0.5)
    if kind == "AREA":
        size_x, size_y = random.uniform(0.1, 0.6, 2)
        return Light("lamp", kind, color, at, size_x=float(size_x), size_y=float(size_y))
    return Light("lamp", kind, color, at)


def _grid(kind, random):
    resolution = tuple(int(count) for count in np.where(random.random(3) < 0.25, 3, 2))
    reach = {"on the walls": 1.0, "into the walls": 1.05, "beyond": 1.4}.get(kind, 0.85)
    matrix = np.diag([*(reach * ROOM), 1.0])
    if kind == "turned":
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        matrix[:3, :3] = turn * np.linalg.det(turn) * 0.7
    elif kind == "sheared":
        matrix[0, 1], matrix[1, 2] = 0.3, -0.2
    elif kind == "mirrored":
        matrix[:, 0] *= -1
    elif kind == "flat":
        resolution = (*resolution[:2], 1)
    elif kind == "single":
        resolution = (1, 1, 1)
    matrix[:3, 3] = 0.0 if kind == "on the walls" else 0.01 * random.normal(size=3)
    return Grid(matrix, resolution)
