# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurements of ``bench peers`` and ``bench pareto``: all of them light the scene that the request names.

* ``gridlight``: reading the scene and the bake to convergence, cold with GPU context and shader compilation, then warm
  (the median of a few).
* ``cycles``: one panorama per location of the grid, with persistent data. Building the scene and projecting are not
  counted.
* ``reference``: what errors are measured against; not a peer, not timed.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import bpy
import numpy as np

from ..bake.bake_job import BakeJob
from ..bake.result import BakeResult
from ..core import lookup
from ..core import spherical_harmonics as sh
from ..core.conventions import ACTIVE
from ..core.errors import Cancelled, InputError
from ..core.field import Field
from ..core.grid import Grid
from ..core.panorama import panorama_irradiance, project_panorama
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..gpu_shaders.context import device_description
from ..scene.cycles_reference import render_panoramas
from ..scene.read import read_scene
from . import bench_scenes, pipeline
from .bench_measure import report
from .result_files import NOT_CONVERGED
from .run_clock import RunClock
from .verify_points import SIX_NORMALS, FreeSpace

_MOST_WARM, _WARM_SECONDS = 15, 1.5  # warm bakes, until one of the two is reached
REFERENCE_WIDTH, REFERENCE_HEIGHT = 128, 64
PEER_SEED, REFERENCE_SEEDS = 1, (1_000_003, 2_000_003)  # panoramas take consecutive seeds: the series never meet


def gridlight(request: dict, reporter, should_stop) -> int:
    """Reading and baking with ``request["settings"]``: cold, then warm; irradiance at as many ``nodes`` as asked. Or
    once, where that is "only" the "first" of a process, with shaders that another has left in the drivers' cache."""
    scene = load_scene(request, reporter)
    settings = BakeSettings(**request["settings"])
    only = request.get("only")
    last = _bake_once(scene, request["scene"], settings, only or "cold", reporter, should_stop)
    report(last.row)
    warm: list[dict] = []
    started = time.perf_counter()
    while not only and (not warm or (len(warm) < _MOST_WARM and time.perf_counter() - started < _WARM_SECONDS)):
        shown = last.snapshot, last.result.scene  # live on until the next bake is done, as in the interface
        del last  # a bake's other textures are freed before the next starts
        last = _bake_once(scene, request["scene"], settings, "warm", reporter, should_stop)
        del shown
        warm.append(last.row)
    if warm:
        report({**median_row(warm), "runs": len(warm)})
    result, snapshot = last.result, last.snapshot
    grid = result.field.grid
    facts = facts_about(request["scene"], snapshot, grid)
    facts["scene"]["probes"] = result.counts
    report(
        {
            **facts,
            "bake": {
                "iterations": result.iterations,
                "converged": result.converged,
                "capture": result.capture,
                "notes": result.notes,
            },
        }
    )
    if request["nodes"]:
        reporter.phase("error nodes")
        nodes = free_nodes(result.field, FreeSpace(snapshot), request["nodes"], settings.seed)
        report({"nodes": nodes.tolist(), "irradiance": irradiance_at(result.field, nodes).tolist()})
    reporter.finish()
    return 0 if result.converged or settings.bounces is not None else NOT_CONVERGED


def facts_about(name: str, snapshot: SceneSnapshot, grid: Grid) -> dict:
    """Device, Blender and scene, for the heads of tables. Needs a GPU context."""
    return {
        "device": device_description(),
        "blender": bpy.app.version_string,
        "scene": {
            "name": name,
            "triangles": len(snapshot.triangles),
            "locations": grid.count,
            "resolution": list(grid.resolution),
        },
    }


def median_row(rows: list[dict]) -> dict:
    """The row of the median time: its phases belong to it."""
    return sorted(rows, key=lambda row: row["seconds"])[len(rows) // 2]


@dataclass
class _Baked:
    row: dict
    snapshot: SceneSnapshot
    result: BakeResult


def _bake_once(scene, name: str, settings: BakeSettings, run: str, reporter, should_stop) -> _Baked:
    stopwatch = RunClock()
    pipeline.start_gpu(reporter, stopwatch)
    with stopwatch("read"):
        reporter.phase(f"read ({run})")
        snapshot = read_scene(scene)
    grid = bench_scenes.grid_of(name, snapshot)
    result = pipeline.bake_volumes([BakeJob(snapshot, grid, settings)], reporter, should_stop, stopwatch)[0]
    seconds = stopwatch.totals()
    row = {
        "run": run,
        "seconds": seconds.pop("total"),
        "measured": grid.count,
        "phases": {phase: value for phase, value in seconds.items() if phase != "write"},
    }
    return _Baked(row, snapshot, result)


def load_scene(request: dict, reporter) -> bpy.types.Scene:
    """The scene that ``request`` names."""
    reporter.phase("build")
    return bench_scenes.load(request["scene"])


def irradiance_at(field: Field, points: np.ndarray) -> np.ndarray:
    """(N, 6, 3) by the lookup at ``points`` (N, 3), six normals each."""
    count = len(SIX_NORMALS)
    values = lookup.irradiance(field, np.repeat(points, count, axis=0), np.tile(SIX_NORMALS, (len(points), 1)))
    return values.reshape(len(points), count, 3)


def free_nodes(field: Field, space: FreeSpace, count: int, seed: int) -> np.ndarray:
    """Up to ``count`` (N, 3) world positions of active nodes in free space, chosen by ``seed``.

    Nodes that the bake moved are left out: a node's own light is compared, not an interpolation.

    Raises:
        InputError: there is none.
    """
    nodes = field.grid.positions()[(field.state == ACTIVE) & ~field.offset.any(axis=1)]
    nodes = nodes[space.is_free(nodes)]
    if not len(nodes):
        raise InputError("no active node stands in free space: there is nothing to measure errors at")
    return nodes[np.sort(np.random.default_rng(seed).permutation(len(nodes))[:count])]


def cycles(request: dict, reporter, should_stop) -> None:
    """Panoramas at all of the grid's locations or at as many as ``request`` says, and irradiance at its nodes."""
    scene = load_scene(request, reporter)
    width, height, samples = request["panorama"]
    positions = bench_scenes.grid_of(request["scene"], read_scene(scene)).positions()
    total = len(positions)
    measured = min(request["panoramas"] or total, total)
    positions = positions[np.linspace(0, total - 1, measured).round().astype(int)]
    ticks = []

    def progress(_done, _total):
        ticks.append(time.perf_counter())
        reporter.advance(1)
        if should_stop():
            raise Cancelled("cancelled")

    reporter.phase(f"Cycles {width}×{height}, {samples} samples", measured)
    started = time.perf_counter()
    render_panoramas(scene, positions, width, height, samples, PEER_SEED, progress=progress)
    first, rest = ticks[0] - started, ticks[-1] - ticks[0]
    if measured < total:  # the first panorama also carries the scene to Cycles, once: only the others are scaled
        rest = rest / (measured - 1) * (total - 1) if measured > 1 else first * (total - 1)
    report(
        {"run": "persistent", "seconds": first + rest, "measured": measured, "phases": {"first": first, "rest": rest}}
    )
    if request["nodes"]:
        reporter.phase("error nodes", len(request["nodes"]))
        images = render_panoramas(
            scene, np.array(request["nodes"]), width, height, samples, PEER_SEED, progress=progress
        )
        coefficients = np.stack([project_panorama(image, request["bands"]) for image in images])
        report({"irradiance": sh.irradiance(coefficients[:, None], SIX_NORMALS).tolist()})
    reporter.finish()


def reference(request: dict, reporter, should_stop) -> None:
    """Irradiance at ``request["nodes"]`` by two series of fine panoramas, and what bands make of them."""
    scene = load_scene(request, reporter)
    nodes = np.array(request["nodes"])

    def progress(_done, _total):
        reporter.advance(1)
        if should_stop():
            raise Cancelled("cancelled")

    reporter.phase("reference", len(REFERENCE_SEEDS) * len(nodes))
    images = [
        render_panoramas(scene, nodes, REFERENCE_WIDTH, REFERENCE_HEIGHT, request["samples"], seed, progress=progress)
        for seed in REFERENCE_SEEDS
    ]
    series = [[panorama_irradiance(image, SIX_NORMALS).tolist() for image in row] for row in images]
    perfect = np.stack([project_panorama(image, request["bands"]) for image in np.mean(images, axis=0)])
    report({"series": series, "floor": sh.irradiance(perfect[:, None], SIX_NORMALS).tolist()})
    reporter.finish()
