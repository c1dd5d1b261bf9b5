# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms that no setting was tuned to against Cycles, as ``gridlight verify --trilinear`` measures: probes, places
between them, and surfaces; default settings.

``scripts/test 5.2 -- tests/blender/test_rooms_cycles.py -m nightly -s`` prints the table of docs/measurements.md.
"""

import measured_rooms
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_measure import Reference, measure
from gridlight.core.settings import BakeSettings
from gridlight.scene.read import read_scene

pytestmark = [pytest.mark.any_version, pytest.mark.nightly]

SAMPLES, HEIGHT = 16, 32
MOST_AT_PROBES = 3.5  # percent above the floor; the sun between slats is finer than texels


@pytest.mark.gpu
@pytest.mark.parametrize("name", measured_rooms.ROOMS)
def test_rooms_that_nothing_was_tuned_to(gpu_context, name):
    scene, grid = measured_rooms.ROOMS[name]()
    scene.view_layers[0].update()
    snapshot, quiet = read_scene(scene), Reporter(quiet=True)
    field = run_bake(BakeJob(snapshot, grid, BakeSettings()), quiet, lambda: False).field
    reference = Reference(scene, SAMPLES, HEIGHT, None, quiet, lambda: False)
    rows = measure(field, measured_rooms.places(scene, snapshot, field), reference, quiet, True)
    probes, free, surface = ({name: 100 * value for name, value in row_figures(row).items()} for row in rows)
    print(
        f"\n| {name} | {probes['floor']:.1f} | {probes['error']:.1f} ({probes['bias']:+.1f}) | "
        f"{free['trilinear']:.1f} | {free['error']:.1f} | {surface['trilinear']:.1f} | {surface['error']:.1f} |"
    )
    assert probes["error"] < probes["floor"] + MOST_AT_PROBES
    assert free["error"] < max(free["trilinear"], probes["error"]) + 0.5, "no gain over plain lookups"


def row_figures(row) -> dict[str, float]:
    return {
        "error": row.error.relative_rms,
        "bias": row.error.bias,
        "floor": row.floor.relative_rms,
        "trilinear": row.trilinear.relative_rms,
    }
