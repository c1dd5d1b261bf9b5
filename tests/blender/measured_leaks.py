# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that is read behind a wall of 10 cm: a lit and a dark closed room, one volume over both."""

from dataclasses import dataclass

import measured_rooms
import numpy as np
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_points import SIX_NORMALS
from gridlight.core import lookup
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.scene.read import read_scene

WALL_M, ROOM_M, POINTS = 0.1, 2.5, 1500
MOST_LEAK = 0.005  # of the lit room's mean
VOLUMES = [
    ("inset 15 cm", 0.15, (9, 5, 5)),  # a node in the wall
    ("inset 15 cm", 0.15, (6, 4, 4)),
    ("inset 15 cm", 0.15, (12, 6, 6)),
    ("inset 15 cm", 0.15, (4, 3, 3)),
    ("inset 15 cm", 0.15, (3, 2, 2)),
    ("inset 30 cm", 0.3, (5, 3, 2)),
    ("10 cm into the walls", -0.1, (6, 4, 4)),
    ("10 cm into the walls", -0.1, (10, 6, 6)),
    ("10 cm into the walls", -0.1, (4, 3, 3)),
    ("on the walls", 0.0, (7, 5, 5)),
]


@dataclass(frozen=True)
class Leak:
    """Irradiance in the dark room, in shares of the mean in the lit one. True value: 0."""

    free: float  # mean of six normals at random points
    brightest: float  # of those points
    wall: float  # mean of the dark side of the wall between
    floor: float

    @property
    def largest_mean(self) -> float:
        return max(self.free, self.wall, self.floor)


def inset_by(inset: float, resolution: tuple[int, int, int]) -> Grid:
    """A volume over both rooms, ``inset`` metres from their outer walls."""
    far = 2 * ROOM_M + WALL_M
    return Grid.from_bounds((inset,) * 3, (far - inset, ROOM_M - inset, ROOM_M - inset), resolution)


def at_random(count: int, seed: int) -> list[Grid]:
    """Volumes that nobody chose: 40 cm inset to 15 cm into the walls, 2,2,2 to 7,4,4 nodes, every second one turned
    about z by 5 to 85° and so large that it holds the same, and much that is outside."""
    random = np.random.default_rng(seed)
    grids = []
    for number in range(count):
        x, y, z = (int(random.integers(2, most + 1)) for most in (7, 4, 4))
        grid = inset_by(random.uniform(-0.15, 0.4), (x, y, z))
        angle = np.radians(random.uniform(5, 85)) * (number % 2)
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        matrix = grid.matrix.copy()
        matrix[:3, :3] = turn * (np.abs(turn.T) @ np.diag(grid.matrix)[:3])
        grids.append(Grid(matrix, grid.resolution, grid.name))
    return grids


def bake(grid: Grid) -> Field:
    """The two rooms in one volume; default settings."""
    snapshot = read_scene(measured_rooms.two_rooms()[0])
    return run_bake(BakeJob(snapshot, grid, BakeSettings()), Reporter(quiet=True), lambda: False).field


def leak(field: Field) -> Leak:
    """What today's lookup reads of ``field`` in the dark room."""
    lit_points = np.random.default_rng(0).uniform(0.02, ROOM_M - 0.02, (POINTS, 3))
    shift = np.array([ROOM_M + WALL_M, 0.0, 0.0])
    lit = _irradiance_at(field, lit_points, SIX_NORMALS).mean()
    dark = _irradiance_at(field, lit_points + shift, SIX_NORMALS).mean(axis=1)
    on_wall = lit_points * [0.0, 1.0, 1.0] + shift + [0.002, 0.0, 0.0]
    wall = _irradiance_at(field, on_wall, np.array([[1.0, 0.0, 0.0]])).mean()
    on_floor = lit_points * [1.0, 1.0, 0.0] + shift + [0.0, 0.0, 0.002]
    floor = _irradiance_at(field, on_floor, np.array([[0.0, 0.0, 1.0]])).mean()
    return Leak(*(float(value / lit) for value in (dark.mean(), dark.max(), wall, floor)))


def _irradiance_at(field, points, normals):
    """(N, K) means of the channels at ``points`` (N, 3) for ``normals`` (K, 3)."""
    found = lookup.irradiance(field, np.repeat(points, len(normals), axis=0), np.tile(normals, (len(points), 1)))
    return found.reshape(len(points), len(normals), 3).mean(axis=2)
