# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that is read behind a wall of 10 cm, volume by volume.

``scripts/test 5.2 -- tests/blender/test_leak_table.py -m nightly -s`` prints the table of docs/measurements.md.
"""

import measured_leaks
import numpy as np
import pytest

pytestmark = [pytest.mark.any_version, pytest.mark.nightly]

MOST_AT_RANDOM, MOST_ABOVE = 0.01, 0.03  # of the lit room; of the volumes


@pytest.mark.gpu
@pytest.mark.parametrize("where, inset, resolution", measured_leaks.VOLUMES)
def test_light_behind_a_wall(gpu_context, where, inset, resolution):
    found = measured_leaks.leak(measured_leaks.bake(measured_leaks.inset_by(inset, resolution)))
    counts = ",".join(map(str, resolution))
    print(
        f"\n| {where} | {counts} | {100 * found.free:.2f} | {100 * found.brightest:.1f} | {100 * found.wall:.2f} | "
        f"{100 * found.floor:.2f} |"
    )
    assert found.largest_mean < measured_leaks.MOST_LEAK


@pytest.mark.gpu
@pytest.mark.parametrize("seed", [1, 2])
def test_volumes_that_nobody_chose(gpu_context, seed):
    leaks = []
    for grid in measured_leaks.at_random(44, seed):
        leaks.append(measured_leaks.leak(measured_leaks.bake(grid)).largest_mean)
        if leaks[-1] > measured_leaks.MOST_LEAK:
            cell = " × ".join(f"{edge:.1f}" for edge in grid.cell_size())
            print(f"\n{grid.resolution}, cells of {cell} m: {100 * leaks[-1]:.2f} %")
    above = sum(leak > measured_leaks.MOST_LEAK for leak in leaks)
    print(f"\n{above} of {len(leaks)} above {100 * measured_leaks.MOST_LEAK:g} %, most {100 * max(leaks):.2f} %")
    assert np.isfinite(leaks).all(), "a volume found no light"
    assert above <= MOST_ABOVE * len(leaks) and max(leaks) < MOST_AT_RANDOM
