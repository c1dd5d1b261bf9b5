# SPDX-License-Identifier: GPL-3.0-or-later
"""Many bakes in one process hold no more memory and no more of the GPU than a few (``scripts/soak``)."""

import gc
import os
from dataclasses import replace

import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import drive
from gridlight.bake.result import Silent
from gridlight.bake.session import BakeSession
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light
from gridlight.tests import process_size
from small_scenes import box, frame, snapshot_of

BAKES = int(os.environ.get("GRIDLIGHT_SOAK_BAKES", "200"))
SETTLED = 50  # bakes after which every shader is compiled and the allocators have found their size
GROWTH = 1.05


def bake_one(number: int) -> None:
    """A room with a box in it, another each time: the lamp elsewhere, captured one way or the other, relit or not."""
    corners = [*box((-1, -1, -1), (1, 1, 1))[:, ::-1], *box((-0.4, -0.4, -1), (0.0, 0.1, -0.3))]
    place = (0.5 * (number % 7) / 7, 0.4, 0.3)
    snapshot = snapshot_of(corners, lights=[Light("lamp", "POINT", (2.0, 2.0, 2.0), frame(place), radius=0.05)])
    grid = Grid.from_bounds((-0.8, -0.8, -0.8), (0.8, 0.8, 0.8), (2, 2, 2 + number % 2))
    settings = BakeSettings(face=4, capture=("trace", "raster")[number % 3 == 0], gather=int(number % 5 == 0))
    session = BakeSession(BakeJob(snapshot, grid, settings), Silent())
    drive(session.bake(), lambda: False)
    if number % 4 == 0:
        brighter = replace(snapshot.lights[0], color=(4.0, 3.0, 2.0))
        drive(session.relight(replace(snapshot, lights=[brighter])), lambda: False)
    if number % 6 == 0:  # one that is given up
        steps = BakeSession(BakeJob(snapshot, grid, settings), Silent()).bake()
        next(steps)
        steps.close()


@pytest.mark.nightly
def test_many_bakes_hold_no_more_than_a_few():
    rows = []
    for number in range(BAKES):
        bake_one(number)
        if (number + 1) % SETTLED == 0:
            gc.collect()
            rows.append({"bakes": number + 1, "MiB": process_size.resident_mib(), **process_size.gpu_objects()})
            print(rows[-1], flush=True)
    first, last = rows[0], rows[-1]
    assert last["bakes"] >= 2 * first["bakes"], "too few bakes to see growth"
    for what in ("MiB", "textures", "buffers", "programs"):
        assert last[what] <= GROWTH * first[what], (what, rows)
