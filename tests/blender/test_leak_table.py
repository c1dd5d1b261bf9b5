# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that is read behind a wall of 10 cm: a lit and a dark closed room, one volume over both.

``scripts/test 5.2 -- tests/blender/test_leak_table.py -m nightly -s`` prints the table of docs/measurements.md.
"""

import measured_rooms
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_points import SIX_NORMALS
from gridlight.core import lookup
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.scene.read import read_scene

pytestmark = [pytest.mark.any_version, pytest.mark.nightly]

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


def irradiance_at(field, points, normals):
    """(N, K) luminance-like means of the channels at ``points`` (N, 3) for ``normals`` (K, 3)."""
    found = lookup.irradiance(field, np.repeat(points, len(normals), axis=0), np.tile(normals, (len(points), 1)))
    return found.reshape(len(points), len(normals), 3).mean(axis=2)


@pytest.mark.gpu
@pytest.mark.parametrize("where, inset, resolution", VOLUMES)
def test_light_behind_a_wall(gpu_context, where, inset, resolution):
    snapshot = read_scene(measured_rooms.two_rooms()[0])
    far = 2 * ROOM_M + WALL_M
    grid = Grid.from_bounds((inset,) * 3, (far - inset, ROOM_M - inset, ROOM_M - inset), resolution)
    field = run_bake(BakeJob(snapshot, grid, BakeSettings()), Reporter(quiet=True), lambda: False).field
    lit_points = np.random.default_rng(0).uniform(0.02, ROOM_M - 0.02, (POINTS, 3))
    shift = np.array([ROOM_M + WALL_M, 0.0, 0.0])
    lit = irradiance_at(field, lit_points, SIX_NORMALS).mean()
    dark = irradiance_at(field, lit_points + shift, SIX_NORMALS).mean(axis=1) / lit
    on_wall = lit_points * [0.0, 1.0, 1.0] + shift + [0.002, 0.0, 0.0]
    wall = irradiance_at(field, on_wall, np.array([[1.0, 0.0, 0.0]])).mean() / lit
    on_floor = lit_points * [1.0, 1.0, 0.0] + shift + [0.0, 0.0, 0.002]
    floor = irradiance_at(field, on_floor, np.array([[0.0, 0.0, 1.0]])).mean() / lit
    counts = ",".join(map(str, resolution))
    print(
        f"\n| {where} | {counts} | {100 * dark.mean():.2f} | {100 * dark.max():.1f} | {100 * wall:.2f} | "
        f"{100 * floor:.2f} |"
    )
    assert max(dark.mean(), wall, floor) < MOST_LEAK
