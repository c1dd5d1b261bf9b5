# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials with a back or a shadow of their own against Cycles: what probes of a closed room hold, default settings.

``scripts/test 5.2 -- tests/blender/test_sided_cycles.py -m nightly -s`` prints the table of docs/measurements.md.
"""

import pytest
import sided_rooms
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli import verify, verify_points
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_measure import Reference, measure
from gridlight.core.settings import BakeSettings
from gridlight.scene.read import read_scene

pytestmark = [pytest.mark.any_version, pytest.mark.nightly]


@pytest.mark.gpu
@pytest.mark.parametrize("method", ["trace", "raster"])
@pytest.mark.parametrize("name", sided_rooms.ROOMS)
def test_sides_and_shadows(gpu_context, name, method):
    scene, grid = sided_rooms.ROOMS[name]()
    scene.view_layers[0].update()
    snapshot, quiet = read_scene(scene), Reporter(quiet=True)
    field = run_bake(BakeJob(snapshot, grid, BakeSettings(capture=method)), quiet, lambda: False).field
    space = verify_points.FreeSpace(snapshot, verify_points.cycles_light(scene))
    reference = Reference(scene, 16, 32, None, quiet, lambda: False)
    points = verify.choose_points(field, space, 12, 0)[:1]
    (probes,) = measure(field, points, reference, quiet, False)
    error, floor, bias = (
        100 * figure for figure in (probes.error.relative_rms, probes.floor.relative_rms, probes.error.bias)
    )
    print(f"\n| {name} | {method} | {floor:.1f} | {error:.1f} ({bias:+.1f}) |")
    assert error < floor + 2.0
