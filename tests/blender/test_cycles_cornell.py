# SPDX-License-Identifier: GPL-3.0-or-later
"""Many bounces against Cycles: a Cornell-like room, irradiance for six normals at nodes in free space, default
settings."""

import bpy
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_points import SIX_NORMALS, FreeSpace
from gridlight.core import lookup, measures
from gridlight.core.conventions import ACTIVE
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_irradiance
from gridlight.core.settings import BakeSettings
from gridlight.tests import scenes

assert bpy  # gridlight's GPU modules are importable only with Blender in the process

pytestmark = pytest.mark.any_version

INSIDE = Grid.from_bounds([0.15] * 3, [scenes.ROOM_SIZE_M - 0.15] * 3, (5, 5, 5), "inside the walls")
INTO_WALLS = Grid.from_bounds([-0.1] * 3, [scenes.ROOM_SIZE_M + 0.1] * 3, (5, 5, 5), "into the walls")
TOLERANCE = 0.05
NOISE = 0.01
NODES = 20


def bake(scene, grid):
    from gridlight.scene.read import read_scene

    result = run_bake(BakeJob(read_scene(scene), grid, BakeSettings()), Reporter(quiet=True), lambda: False)
    assert result.converged
    return result.field


@pytest.fixture(scope="module")
def reference():
    """Free nodes of both grids with their irradiance by Cycles: {grid name: (nodes, (N, 6, 3) irradiance)}.

    All variants of the room have the same inside, so one reference serves them all.
    """
    from gridlight.scene.cycles_reference import render_panoramas
    from gridlight.scene.read import read_scene

    scene = scenes.cornell()
    space = FreeSpace(read_scene(scene))
    found = {}
    for grid in (INSIDE, INTO_WALLS):
        positions = grid.positions()
        inside = ((positions > 0) & (positions < scenes.ROOM_SIZE_M)).all(axis=1)
        nodes = np.flatnonzero(space.is_free(positions) & inside)
        nodes = np.sort(np.random.default_rng(1).permutation(nodes)[:NODES])
        series = []
        for seed in (1, 1001):
            images = render_panoramas(scene, positions[nodes], 128, 64, 4, seed)
            series.append(np.stack([panorama_irradiance(image, SIX_NORMALS) for image in images]))
        noise = measures.noise_of_mean(*series)
        assert noise < NOISE
        found[grid.name] = nodes, np.mean(series, axis=0), noise
    return found


def check(grid, field, reference):
    nodes, truth, noise = reference[grid.name]
    positions = np.repeat(grid.positions()[nodes], len(SIX_NORMALS), axis=0)
    ours = lookup.irradiance(field, positions, np.tile(SIX_NORMALS, (len(nodes), 1))).reshape(truth.shape)
    figures = measures.compare(ours, truth)
    print(f"{figures}, noise {noise}")
    assert (field.state[nodes] == ACTIVE).all()
    assert figures.relative_rms < TOLERANCE


@pytest.mark.parametrize("walls", ["thick", "planes", "cube"])
def test_room_seen_from_a_volume_inside_it(gpu_context, reference, walls):
    check(INSIDE, bake(scenes.cornell(walls), INSIDE), reference)


@pytest.mark.parametrize("walls", ["thick", "planes", "cube"])
def test_room_seen_from_a_volume_that_reaches_into_its_walls(gpu_context, reference, walls):
    check(INTO_WALLS, bake(scenes.cornell(walls), INTO_WALLS), reference)
