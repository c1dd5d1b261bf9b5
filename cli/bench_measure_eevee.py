# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE's own bake of a light probe volume, for ``bench peers`` and ``bench pareto``."""

from __future__ import annotations

import bpy
import numpy as np

from ..core.errors import Cancelled, InputError
from ..scene import eevee_volume
from ..scene.read import read_scene
from . import bench_scenes, pipeline
from .bench_measure import report
from .bench_measure_peers import load_scene
from .run_clock import RunClock
from .verify_points import SIX_NORMALS

_EEVEE_VALUES = 4 * 3  # that EEVEE keeps per probe, at least: two bands of RGB as 32-bit floats


def eevee(request: dict, reporter, should_stop) -> None:
    """The bake of a volume whose probes stand at the grid's nodes, cold and warm; irradiance at the request's nodes."""
    scene = load_scene(request, reporter)
    grid = bench_scenes.grid_of(request["scene"], read_scene(scene))
    item = eevee_volume.add_volume(scene, grid, request["samples"])
    count = grid.count
    empty = eevee_volume.stored_bytes(item)
    for run in ("cold", "warm"):
        if should_stop():
            raise Cancelled("cancelled")
        stopwatch = RunClock()
        pipeline.start_gpu(reporter, stopwatch)
        reporter.phase(f"EEVEE volume bake ({run}); it does not say how far it is")
        with stopwatch("light"):
            done = bpy.ops.object.lightprobe_cache_bake(subset="ALL")
        seconds = stopwatch.totals()
        # The operator also finishes where it has given up, so what it is timed for has to be there.
        if done != {"FINISHED"} or eevee_volume.stored_bytes(item) - empty < 4 * _EEVEE_VALUES * count:
            raise InputError("EEVEE's bake ended without a result (--verbose shows Blender's words)")
        report(
            {
                "run": run,
                "seconds": seconds["total"],
                "measured": count,
                "phases": {"setup": seconds["setup"], "bake": seconds["light"]},
            }
        )
        if run == "cold":
            bpy.ops.object.lightprobe_cache_free(subset="ALL")
    if request["nodes"]:
        reporter.phase("cards", len(SIX_NORMALS))

        def progress() -> None:
            reporter.advance()
            if should_stop():
                raise Cancelled("cancelled")

        nodes = np.array(request["nodes"])
        report({"irradiance": eevee_volume.irradiance_on_cards(scene, item, nodes, SIX_NORMALS, progress).tolist()})
    reporter.finish()
