# SPDX-License-Identifier: GPL-3.0-or-later
"""Rooms with mirrors, metal and gloss against Cycles, at probes; and the same with all gloss sent evenly.

``scripts/test 5.2 -- tests/blender/test_gloss_cycles.py -m nightly -s`` prints the table of docs/measurements.md.
"""

from dataclasses import replace

import glossy_rooms
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.cli.progress import Reporter
from gridlight.cli.verify_points import SIX_NORMALS
from gridlight.core import lookup, measures
from gridlight.core import spherical_harmonics as sh
from gridlight.core.conventions import ACTIVE
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_directions, panorama_irradiance, panorama_solid_angles
from gridlight.core.settings import BakeSettings
from gridlight.core.world_suns import extract_suns

pytestmark = pytest.mark.any_version
WIDTH, HEIGHT = 64, 32


def irradiance_of(field, positions):
    points = np.repeat(positions, len(SIX_NORMALS), axis=0)
    found = lookup.irradiance(field, points, np.tile(SIX_NORMALS, (len(positions), 1)))
    return found.reshape(len(positions), len(SIX_NORMALS), 3)


def measured(name, probes, samples):
    """Relative RMS and bias with gloss and without, and noise and floor of the reference."""
    from gridlight.scene.cycles_reference import render_panoramas
    from gridlight.scene.read import read_scene

    scene, size = glossy_rooms.build(name)
    snapshot = read_scene(scene)
    grid = Grid.from_bounds(0.12 * size, 0.88 * size, (4, 4, 3))
    even = [replace(material, gloss=None, faint_gloss=None) for material in snapshot.materials]
    diffuse = replace(snapshot, materials=even)
    jobs = [BakeJob(each, grid, BakeSettings()) for each in (snapshot, diffuse)]
    fields = [run_bake(job, Reporter(quiet=True), lambda: False).field for job in jobs]
    active = (fields[0].state == ACTIVE) & (fields[1].state == ACTIVE)
    nodes = np.random.default_rng(1).permutation(np.flatnonzero(active))[:probes]
    positions = (grid.positions() + fields[0].offset)[nodes]
    suns = extract_suns(snapshot.world)[1]
    images = [render_panoramas(scene, positions, WIDTH, HEIGHT, samples, seed, suns=suns) for seed in (1, 1001)]
    series = [np.stack([panorama_irradiance(image, SIX_NORMALS) for image in each]) for each in images]
    truth, weights = np.mean(series, axis=0), panorama_solid_angles(WIDTH, HEIGHT).ravel()
    directions = panorama_directions(WIDTH, HEIGHT).reshape(-1, 3)
    mean = np.mean(images, axis=0).astype(float).reshape(len(nodes), -1, 3)
    in_bands = sh.irradiance(sh.project(mean, directions, weights, 3)[:, None], SIX_NORMALS[None])
    floor = measures.compare(in_bands, truth).relative_rms
    rows = [measures.compare(irradiance_of(field, positions), truth) for field in fields]
    return (*rows, measures.noise_of_mean(*series), floor)


def show(name, gloss, diffuse, noise, floor):
    print(
        f"\n{name:20} {100 * diffuse.relative_rms:5.1f} ({100 * diffuse.bias:+.1f})  {100 * gloss.relative_rms:5.1f} "
        f"({100 * gloss.bias:+.1f})  worst {100 * gloss.worst:.1f}  floor {100 * floor:.1f}  noise {100 * noise:.1f}"
    )


@pytest.mark.nightly
@pytest.mark.parametrize("name", glossy_rooms.ROOMS)
def test_gloss_against_cycles(gpu_context, name):
    gloss, diffuse, noise, floor = measured(name, 10, 128)
    show(name, gloss, diffuse, noise, floor)
    assert gloss.relative_rms < 1.5 * (floor + noise) + 0.015
    assert gloss.relative_rms < 1.02 * diffuse.relative_rms


@pytest.mark.parametrize("name", ["coated wood", "all of grey plastic", "plastic floor in the sun, 0.35"])
def test_gloss_helps(gpu_context, name):
    """Followed, or sent by angles with highlights: two of these rooms, quickly."""
    gloss, diffuse, noise, floor = measured(name, 3, 8)
    show(name, gloss, diffuse, noise, floor)
    assert gloss.relative_rms < 0.3 * diffuse.relative_rms + noise
