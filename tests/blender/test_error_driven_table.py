# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes that were given an error against Cycles: what was asked for, predicted and found, and what it cost beside the
cheapest of a list of settings that would have done (a nightly test; -s prints the table of docs/measurements.md).

The error is that of ``verify``'s first row: irradiance for six normals at active probes in free space.
"""

import time

import bpy
import measured_rooms
import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.error_driven import ErrorDrivenBake
from gridlight.bake.result import Silent
from gridlight.bake.session import BakeSession
from gridlight.cli import verify_points
from gridlight.core import measures
from gridlight.core import spherical_harmonics as sh
from gridlight.core.error_budget import ErrorGoal
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_irradiance, project_panorama
from gridlight.core.settings import BakeSettings
from gridlight.formats import probe_file
from gridlight.scene.cycles_reference import render_panoramas
from gridlight.scene.gallery import build_gallery
from gridlight.scene.read import read_scene

TARGETS = (0.10, 0.05, 0.03, 0.02)
BY_HAND = ((6, 1), (8, 1), (12, 1), (16, 2), (24, 2), (32, 4))  # face, samples
POINTS, HEIGHT, SAMPLES, SEEDS = 40, 64, 6, (1, 1_000_003)  # few probes make most of the error of a glowing strip
LEAST_MET, MOST_COST = 0.9, 3.0


def gallery():
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene = build_gallery(bpy.context.scene)
    volume = read_scene(scene).volumes[0]
    return scene, Grid(volume.matrix, volume.resolution)


SCENES = {
    "gallery": gallery,
    "Cornell, area light": measured_rooms.in_cornell(),
    "Cornell, spot": measured_rooms.in_cornell(light="spot"),
    "Cornell of planes, point": measured_rooms.in_cornell(walls="planes", light="point"),
    "Cornell of a cube, area light": measured_rooms.in_cornell(walls="cube"),
    "Cornell, glowing strip": measured_rooms.in_cornell(light="strip"),
    "lit and dark room": measured_rooms.two_rooms,
    "window, sun and sky": measured_rooms.window,
    "outdoors, sun and sky": measured_rooms.outdoors,
    "glowing panel": measured_rooms.panel,
}


class Judge:
    """Cycles at some probes of a scene."""

    def __init__(self, scene, snapshot, grid, field):
        space = verify_points.FreeSpace(snapshot, verify_points.cycles_light(scene))
        nodes = np.flatnonzero(field.state == 1)
        nodes = nodes[np.random.default_rng(0).permutation(len(nodes))[: 2 * POINTS]]
        positions = (grid.positions() + field.offset)[nodes]
        free = space.is_free(positions)
        self._nodes, positions = nodes[free][:POINTS], positions[free][:POINTS]
        self._offset = field.offset[self._nodes]
        images = [render_panoramas(scene, positions, 2 * HEIGHT, HEIGHT, SAMPLES, seed) for seed in SEEDS]
        normals = verify_points.SIX_NORMALS
        series = [np.stack([panorama_irradiance(image, normals) for image in seed]) for seed in images]
        self._reference = np.mean(series, axis=0)
        perfect = np.stack([project_panorama((a + b) / 2, 3) for a, b in zip(*images)])
        self.floor = measures.compare(sh.irradiance(perfect[:, None], normals), self._reference).relative_rms
        self.noise = measures.noise_of_mean(*series)

    def __call__(self, field) -> float:
        held = sh.irradiance(field.coefficients[self._nodes].astype(float)[:, None], verify_points.SIX_NORMALS)
        there = np.abs(field.offset[self._nodes] - self._offset).max(axis=1) < 1e-5  # not moved elsewhere by this bake
        return measures.compare(held[there], self._reference[there]).relative_rms


def timed(bake):
    """The finished result of ``bake``, a session, and processor seconds."""
    started = time.process_time()
    for _ in bake.bake():
        pass
    return bake.result, time.process_time() - started


def bytes_of(field, folder):
    path = folder / "probes.exr"
    probe_file.write(path, field)
    return path.stat().st_size


def table_of(name, folder):
    """Rows of a scene: target, verified, what the bake said, seconds, seconds by hand, share of bytes that bands which
    were given up leave."""
    scene, grid = SCENES[name]()
    snapshot = read_scene(scene)
    first, _ = timed(BakeSession(BakeJob(snapshot, grid, BakeSettings(face=6)), Silent()))  # also compiles shaders
    judge = Judge(scene, snapshot, grid, first.field)
    by_hand = []
    for face, samples in BY_HAND:
        job = BakeJob(snapshot, grid, BakeSettings(face=face, samples=samples))
        result, seconds = timed(BakeSession(job, Silent()))
        by_hand.append((judge(result.field), seconds))
    rows = []
    for target in TARGETS:
        bake = ErrorDrivenBake(BakeJob(snapshot, grid, BakeSettings()), ErrorGoal(target), Silent())
        result, seconds = timed(bake)
        cheapest = min((cost for error, cost in by_hand if error <= target), default=None)
        share = bytes_of(result.field, folder) / bytes_of(bake.whole, folder)
        rows.append((target, judge(result.field), result.error, seconds, cheapest, share))
    print(
        f"\n{name}: floor {100 * judge.floor:.2f}, noise {100 * judge.noise:.2f}, by hand at best "
        f"{100 * min(error for error, _ in by_hand):.2f}"
    )
    for target, verified, error, seconds, cheapest, share in rows:
        ratio = f"{seconds / cheapest:.1f}" if cheapest else "–"
        print(
            f"| {name} | {100 * target:g} | {100 * error['predicted']:.2f} ({100 * error['predicted_at_most']:.2f}) | "
            f"{100 * verified:.2f} | {'yes' if error['met'] else 'no'} | {seconds:.1f} | {ratio} | "
            f"{error['passes'][-1]} | {'/'.join(map(str, error['bands'].values()))} | {100 * share:.0f} |"
        )
    return [(*row, judge.floor) for row in rows]


@pytest.mark.gpu
@pytest.mark.nightly
def test_verified_errors_are_below_their_targets(gpu_context, tmp_path):
    rows = [row for name in SCENES for row in table_of(name, tmp_path)]
    promised = [row for row in rows if row[2]["met"]]
    possible = [row for row in rows if row[-1] < row[0]]  # three bands can say it
    kept, met = (np.mean([verified <= target for target, verified, *_ in some]) for some in (promised, possible))
    ratios = [seconds / cheapest for *_, seconds, cheapest, _share, _floor in rows if cheapest]
    within = np.mean([ratio <= MOST_COST for ratio in ratios])
    print(f"\n{len(promised)} of {len(rows)} promised, {100 * kept:.0f} % of them kept")
    print(f"{len(possible)} possible by the bands, {100 * met:.0f} % of them met")
    print(
        f"cost against the cheapest by hand: median {np.median(ratios):.1f}, most {max(ratios):.1f}, "
        f"{100 * within:.0f} % within {MOST_COST:g}"
    )
    assert kept >= LEAST_MET and met >= LEAST_MET
    assert within >= LEAST_MET
