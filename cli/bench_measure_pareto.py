# SPDX-License-Identifier: GPL-3.0-or-later
"""Our bake with many settings of one scene in one process, for ``bench pareto``."""

from __future__ import annotations

import time

import numpy as np

from ..bake.bake_job import BakeJob
from ..bake.job import run_bake
from ..core.settings import BakeSettings
from ..gpu_shaders.context import ensure_context
from ..scene.read import read_scene
from . import bench_scenes
from .bench_measure import report
from .bench_measure_peers import facts_about, free_nodes, irradiance_at, load_scene
from .verify_points import FreeSpace

_MOST_RUNS, _REPEAT_SECONDS = 7, 1.0  # warm bakes of each setting, until one of the two is reached
_MOST_AGAIN_SECONDS = 60.0  # a first bake that took longer is not repeated: its shaders are a small part of it


def settings_in_turn(request: dict, reporter, should_stop) -> None:
    """Bakes ``request["settings"]``, a list, one after the other while ``request["seconds"]`` last, and reports each
    with its irradiance at the nodes.

    The nodes are ``request["nodes"]``, or as many of the first bake's as that says.
    """
    scene = load_scene(request, reporter)
    ensure_context()
    snapshot = read_scene(scene)
    started = time.perf_counter()
    snapshot = read_scene(scene)  # again: all bakes but the first of a process find most of it kept
    read_seconds = time.perf_counter() - started
    grid = bench_scenes.grid_of(request["scene"], snapshot)
    report(facts_about(request["scene"], snapshot, grid))
    nodes = request["nodes"]
    ends, dearest = time.perf_counter() + request["seconds"], 0.0
    for values in request["settings"]:
        if time.perf_counter() + dearest > ends:  # what is left is about as dear as what was
            break
        begun = time.perf_counter()
        settings = BakeSettings(**values)
        reporter.phase(" ".join(f"{name} {value}" for name, value in values.items()))
        first, result = _timed(snapshot, grid, settings, reporter, should_stop)
        if isinstance(nodes, int):
            nodes = free_nodes(result.field, FreeSpace(snapshot), nodes, settings.seed)
            report({"nodes": nodes.tolist()})
        irradiance, counts, capture = irradiance_at(result.field, np.array(nodes)), result.counts, result.capture
        iterations, converged = result.iterations, result.converged
        warm: list[float] = []
        again = time.perf_counter()
        while first < _MOST_AGAIN_SECONDS and (
            not warm or (len(warm) < _MOST_RUNS and time.perf_counter() - again < _REPEAT_SECONDS)
        ):
            result = None  # its textures are freed before the next bake
            seconds, result = _timed(snapshot, grid, settings, reporter, should_stop)
            warm.append(seconds)
        report(
            {
                "run": "warm" if warm else "first",
                "seconds": read_seconds + float(np.median(warm or [first])),
                "measured": grid.count,
                "phases": {"read": read_seconds, "first bake": first, "bake": float(np.median(warm or [first]))},
                "settings": values,
                "counts": counts,
                "capture": capture,
                "iterations": iterations,
                "converged": converged,
                "irradiance": irradiance.tolist(),
            }
        )
        dearest = max(dearest, time.perf_counter() - begun)
    reporter.finish()


def _timed(snapshot, grid, settings, reporter, should_stop):
    """(seconds, result) of one bake. Reading the field back waits for the GPU."""
    started = time.perf_counter()
    result = run_bake(BakeJob(snapshot, grid, settings), reporter, should_stop)
    return time.perf_counter() - started, result
