# SPDX-License-Identifier: GPL-3.0-or-later
"""Light that is read behind a wall of 10 cm, volume by volume.

``scripts/test 5.2 -- tests/blender/test_leak_table.py -m nightly -s`` prints the table of docs/measurements.md.
"""

import measured_leaks
import pytest

pytestmark = [pytest.mark.any_version, pytest.mark.nightly]


@pytest.mark.gpu
@pytest.mark.parametrize("where, inset, resolution", measured_leaks.VOLUMES)
def test_light_behind_a_wall(gpu_context, where, inset, resolution):
    found = measured_leaks.leak(measured_leaks.bake(inset, resolution))
    counts = ",".join(map(str, resolution))
    print(
        f"\n| {where} | {counts} | {100 * found.free:.2f} | {100 * found.brightest:.1f} | {100 * found.wall:.2f} | "
        f"{100 * found.floor:.2f} |"
    )
    assert found.largest_mean < measured_leaks.MOST_LEAK
