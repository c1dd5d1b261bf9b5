# SPDX-License-Identifier: GPL-3.0-or-later
"""What is read between probes where that is hard, against Cycles and perfect probes with plain trilinear lookup.

``scripts/test 5.2 -- tests/blender/test_lookup_rooms.py -m nightly -s`` prints the table of docs/measurements.md.
"""

import lookup_rooms
import measured_rooms
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_measure import Reference, measure
from gridlight.core.settings import BakeSettings
from gridlight.scene.read import read_scene

pytestmark = [pytest.mark.any_version, pytest.mark.nightly]

SAMPLES, HEIGHT = 16, 32
MOST = {"free": 0.055, "surfaces": 0.05}  # geometric means over the rooms
OF_TRILINEAR = 0.5  # of what perfect probes give with plain lookup, likewise


@pytest.mark.gpu
def test_less_is_lost_than_by_plain_lookups(gpu_context):
    errors = {"free": [], "surfaces": []}
    for name in lookup_rooms.ROOMS:
        rows = [(row.error.relative_rms, row.trilinear.relative_rms) for row in room_rows(name)]
        print(f"\n| {name} | " + " | ".join(f"{100 * plain:.1f} | {100 * ours:.1f}" for ours, plain in rows) + " |")
        for kind, row in zip(errors, rows):
            errors[kind].append(row)
    for kind, rows in errors.items():
        ours, plain = np.exp(np.log(rows).mean(axis=0))
        print(f"\n{kind}: {100 * ours:.2f} %, perfect probes and plain lookup {100 * plain:.2f}")
        assert ours < MOST[kind] and ours < OF_TRILINEAR * plain


def room_rows(name):
    """Errors at free places and on surfaces."""
    make_scene, make_grid = lookup_rooms.ROOMS[name]
    scene = make_scene()
    scene.view_layers[0].update()
    grid, snapshot, quiet = make_grid(scene), read_scene(scene), Reporter(quiet=True)
    field = run_bake(BakeJob(snapshot, grid, BakeSettings()), quiet, lambda: False).field
    kinds = measured_rooms.places(scene, snapshot, field)
    reference = Reference(scene, SAMPLES, HEIGHT, None, quiet, lambda: False)
    return measure(field, kinds, reference, quiet, True)[1:]
