# SPDX-License-Identifier: GPL-3.0-or-later
"""The measurements of ``bench``: what runs in a process of its own per peer. All of them light the gallery of ``demo``.

* ``gridlight``: reading the scene and the bake to convergence, twice: cold with GPU context and shader compilation,
  then warm.
* ``cycles``: one panorama per location of the grid, with persistent data. Building the scene and projecting are not
  counted.
* ``eevee``: Blender's own bake of a light probe volume with the same nodes, cold with GPU context and shaders, then
  warm.
* ``reference``: what errors are measured against; not a peer, not timed.

Every report is one JSON object on standard output: ``{"run": …}`` is a row of the table, ``{"problem": …}`` why there
is no more.
"""

from __future__ import annotations

import json
import os
import tempfile
import time

import bpy
import numpy as np
from mathutils import Matrix

from ..core import lookup
from ..core import spherical_harmonics as sh
from ..core.conventions import ACTIVE
from ..core.errors import Cancelled, GridlightError, InputError
from ..core.field import Field
from ..core.grid import Grid
from ..core.panorama import panorama_irradiance, project_panorama
from ..core.settings import BakeSettings
from ..gpu_shaders.context import device_description
from ..scene.cycles_reference import render_panoramas
from ..scene.gallery import build_gallery
from ..scene.read import read_scene
from . import pipeline, worker
from .verify_points import SIX_NORMALS, FreeSpace

REFERENCE_WIDTH, REFERENCE_HEIGHT = 128, 64
PEER_SEED, REFERENCE_SEEDS = 1, (1_000_003, 2_000_003)  # panoramas take consecutive seeds: the series never meet

_EEVEE_VALUES = 4 * 3  # that EEVEE keeps per probe, at least: two bands of RGB as 32-bit floats


def measure(request: dict, reporter, should_stop) -> tuple[dict, int]:
    """Measures ``request["peer"]``, reports rows as they are known, and returns (last report, exit status)."""
    measurements = {"gridlight": _gridlight, "cycles": _cycles, "eevee": _eevee, "reference": _reference}
    status = 0
    try:
        reporter.phase("build")
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        status = measurements[request["peer"]](build_gallery(bpy.context.scene), request, reporter, should_stop) or 0
    except Cancelled:
        raise
    except (GridlightError, RuntimeError) as error:  # RuntimeError: how Blender's operators refuse
        _report({"problem": " ".join(str(error).split())})
        status = getattr(error, "exit_status", 1)
    return {"status": status, "warnings": reporter.warnings}, status


def _report(value: dict) -> None:
    worker.write_result(json.dumps(value, allow_nan=False) + "\n")


def _gridlight(scene, request: dict, reporter, should_stop) -> int:
    settings = BakeSettings(**request["settings"])
    for run in ("cold", "warm"):
        result = None  # the first bake's textures are freed before the second starts
        stopwatch = pipeline.Stopwatch()
        pipeline.start_gpu(reporter, stopwatch)
        with stopwatch.measure("read"):
            reporter.phase(f"read ({run})")
            snapshot = read_scene(scene)
        volume = snapshot.volumes[0]
        grid = Grid(volume.matrix, volume.resolution, volume.name)
        result = pipeline.bake_volumes(snapshot, [grid], settings, reporter, should_stop, stopwatch)[0]
        seconds = stopwatch.totals()
        _report(
            {
                "run": run,
                "seconds": seconds.pop("total"),
                "measured": grid.count,
                "phases": {phase: value for phase, value in seconds.items() if phase != "write"},
            }
        )
    _report(
        {
            "blender": bpy.app.version_string,
            "scene": {
                "locations": grid.count,
                "resolution": list(grid.resolution),
                "triangles": len(snapshot.triangles),
                "probes": result.counts,
            },
            "bake": {"iterations": result.iterations, "converged": result.converged, "capture": result.capture},
            "device": device_description(),
        }
    )
    if request["nodes"]:
        reporter.phase("error nodes")
        nodes = _free_nodes(result.field, FreeSpace(snapshot), request["nodes"], settings.seed)
        count = len(SIX_NORMALS)
        ours = lookup.irradiance(result.field, np.repeat(nodes, count, axis=0), np.tile(SIX_NORMALS, (len(nodes), 1)))
        _report({"nodes": nodes.tolist(), "irradiance": ours.reshape(len(nodes), count, 3).tolist()})
    reporter.finish()
    return 0 if result.converged or settings.bounces is not None else pipeline.NOT_CONVERGED


def _free_nodes(field: Field, space: FreeSpace, count: int, seed: int) -> np.ndarray:
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


def _cycles(scene, request: dict, reporter, should_stop) -> None:
    width, height, samples = request["panorama"]
    volume = read_scene(scene).volumes[0]
    positions = Grid(volume.matrix, volume.resolution).positions()
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
    _report(
        {"run": "persistent", "seconds": first + rest, "measured": measured, "phases": {"first": first, "rest": rest}}
    )
    if request["nodes"]:
        reporter.phase("error nodes", len(request["nodes"]))
        images = render_panoramas(
            scene, np.array(request["nodes"]), width, height, samples, PEER_SEED, progress=progress
        )
        coefficients = np.stack([project_panorama(image, request["bands"]) for image in images])
        _report({"irradiance": sh.irradiance(coefficients[:, None], SIX_NORMALS).tolist()})
    reporter.finish()


def _reference(scene, request: dict, reporter, should_stop) -> None:
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
    _report({"series": series, "floor": sh.irradiance(perfect[:, None], SIX_NORMALS).tolist()})
    reporter.finish()


def _eevee(scene, request: dict, reporter, should_stop) -> None:
    volume = read_scene(scene).volumes[0]
    scene.render.engine = "BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT"
    item = _eevee_volume(scene, Grid(volume.matrix, volume.resolution), request["samples"])
    count = int(np.prod(volume.resolution))
    empty = _stored_bytes(item)
    for run in ("cold", "warm"):
        if should_stop():
            raise Cancelled("cancelled")
        stopwatch = pipeline.Stopwatch()
        pipeline.start_gpu(reporter, stopwatch)
        reporter.phase(f"EEVEE volume bake ({run}); it does not say how far it is")
        with stopwatch.measure("light"):
            done = bpy.ops.object.lightprobe_cache_bake(subset="ALL")
        seconds = stopwatch.totals()
        # The operator also finishes where it has given up, so what it is timed for has to be there.
        if done != {"FINISHED"} or _stored_bytes(item) - empty < 4 * _EEVEE_VALUES * count:
            raise InputError("EEVEE's bake ended without a result (--verbose shows Blender's words)")
        _report(
            {
                "run": run,
                "seconds": seconds["total"],
                "measured": count,
                "phases": {"setup": seconds["setup"], "bake": seconds["light"]},
            }
        )
        bpy.ops.object.lightprobe_cache_free(subset="ALL")
    reporter.finish()


def _eevee_volume(scene, grid: Grid, samples: int) -> bpy.types.Object:
    """A light probe volume of EEVEE whose probes stand at the nodes of ``grid``."""
    data = bpy.data.lightprobes.new("EEVEE volume", "VOLUME")
    data.resolution_x, data.resolution_y, data.resolution_z = grid.resolution
    data.bake_samples = samples
    # EEVEE's probes sit in the middle of cells, ours at their corners: its box is larger by half a cell on every side.
    counts = np.array(grid.resolution)
    matrix = grid.matrix.copy()
    matrix[:3, :3] *= np.where(counts > 1, counts / np.maximum(counts - 1, 1), 1.0)
    item = bpy.data.objects.new("EEVEE volume", data)
    item.matrix_world = Matrix(matrix.tolist())
    scene.collection.objects.link(item)
    scene.view_layers[0].update()
    return item


def _stored_bytes(item: bpy.types.Object) -> int:
    """Size of ``item`` in a file, the only sign of a baked volume that Python can see."""
    with tempfile.TemporaryDirectory(prefix="gridlight-") as folder:
        path = os.path.join(folder, "item.blend")
        bpy.data.libraries.write(path, {item})
        return os.path.getsize(path)
