# SPDX-License-Identifier: GPL-3.0-or-later
"""``bench scaling``, the child's side: one bake after the other of a hall in growing sizes, until the time is up."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from ..bake.bake_job import BakeJob
from ..bake.capture_choice import device_cost
from ..bake.job import drive
from ..bake.session import BakeSession
from ..core import bvh
from ..core.errors import GridlightError
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.snapshot import Light, SceneSnapshot
from ..gpu_shaders import programs
from ..gpu_shaders.context import device_description, ensure_context
from ..gpu_shaders.textures import wait_for_gpu
from ..scene.bench_rooms import HALL_SIZE_M, build_hall
from ..scene.read import read_scene
from . import bench_scenes
from .bench_measure import report
from .bench_measure_peers import median_row
from .bench_phases import PhaseClock

_INSET_M = 0.3
_LAMPS_POWER = 60.0  # of all small lamps: radiant intensity, W/sr
_MOST_RUNS, _REPEAT_SECONDS = 5, 1.0  # of each case, until one of the two is reached
_GROWTH = 1.0  # exponent that the next size is expected to grow by at least


def scaling(request: dict, reporter, should_stop) -> None:
    """Measures the sweeps of ``request`` size by size in turn, so that all of them have come as far when time is up.

    A sweep: {"name", "parameter": "probes" | "triangles" | "face" | "lamps", "capture", "sizes"}; the other parameters
    are those of ``request["base"]``.
    """
    deadline = time.perf_counter() + request["seconds"]
    reporter.phase("GPU context")
    started = time.perf_counter()
    ensure_context()
    bake = _Bakes(request["settings"], should_stop)
    context_seconds = time.perf_counter() - started
    started = time.perf_counter()
    device_cost()
    report(
        {
            "device": device_description(),
            "blender": _blender(),
            "context_seconds": context_seconds,
            "trial_seconds": time.perf_counter() - started,
        }
    )
    running: dict[str, tuple[dict, list]] = {sweep["name"]: (sweep, []) for sweep in request["sweeps"]}
    for turn in range(max(len(sweep["sizes"]) for sweep in request["sweeps"])):
        for name, (sweep, done) in list(running.items()):
            if turn >= len(sweep["sizes"]):
                continue
            size = sweep["sizes"][turn]
            left = deadline - time.perf_counter()
            if left < _expected(done, size):
                report({"left_out": {"sweep": name, "from": size, "expected_seconds": _expected(done, size)}})
                del running[name]
                continue
            case = {**request["base"], sweep["parameter"]: size}
            reporter.phase(f"{name} {size}")
            try:
                row, whole = bake(case, sweep["capture"])
            except (GridlightError, RuntimeError) as error:
                report({"left_out": {"sweep": name, "from": size, "reason": " ".join(str(error).split())}})
                del running[name]
                continue
            done.append((size, whole))
            report({"run": name, "size": size, **row})
    reporter.finish()


def _expected(done: list[tuple[float, float]], size: float) -> float:
    """Seconds that ``size`` will take after what the ``done`` (size, seconds) took; 0 where nothing is known."""
    if not done:
        return 0.0
    growth = _GROWTH
    if len(done) > 1:
        (size0, spent0), (size1, spent1) = done[-2:]
        growth = max(growth, np.log(spent1 / spent0) / np.log(size1 / size0))
    return float(done[-1][1] * (size / done[-1][0]) ** growth)


def _blender() -> str:
    import bpy

    return bpy.app.version_string


class _Bakes:
    """Bakes the hall; keeps the last scene that was read, and knows which shaders are warm."""

    def __init__(self, settings: dict, should_stop):
        self._settings = settings
        self._should_stop = should_stop
        self._triangles, self._read_seconds = 0, 0.0
        self._snapshot: SceneSnapshot | None = None
        self._warm: dict[tuple, float] = {}

    def __call__(self, case: dict, capture: str) -> tuple[dict, float]:
        """(row, seconds that all of it took, building the scene and warming up included)."""
        started = time.perf_counter()
        variant = (case["face"], capture)
        if variant not in self._warm:  # compiles the shaders
            self._read(1000)
            self._warm[variant] = self._bake({**case, "probes": 30}, capture)["seconds"]
            report({"cold": {"face": case["face"], "capture": capture, "seconds": self._warm[variant]}})
        self._read(case["triangles"])
        runs: list[dict] = []
        begun = time.perf_counter()
        while not runs or (len(runs) < _MOST_RUNS and time.perf_counter() - begun < _REPEAT_SECONDS):
            known = programs.compiled()
            run = self._bake(case, capture)
            if programs.compiled() == known:  # larger hierarchies need shaders with larger stacks
                runs.append(run)
        row = median_row(runs)
        row["phases"] = {"read": self._read_seconds, **row["phases"]}
        row["seconds"] += self._read_seconds
        return {**row, "runs": len(runs)}, time.perf_counter() - started

    def _read(self, triangles: int) -> None:
        if self._triangles != triangles:
            self._snapshot = None
            scene = build_hall(bench_scenes.empty_scene(), triangles)
            started = time.perf_counter()
            self._snapshot, self._triangles = read_scene(scene), triangles
            self._read_seconds = time.perf_counter() - started

    def _bake(self, case: dict, capture: str) -> dict:
        grid = Grid.from_bounds([_INSET_M] * 3, HALL_SIZE_M - _INSET_M, resolution_for(case["probes"]))
        settings = BakeSettings(**{**self._settings, "face": case["face"], "capture": capture, "keep_all": True})
        clock = PhaseClock()
        bvh.kept_or_built.forget()
        snapshot = with_lamps(self._snapshot, case["lamps"])
        started = time.perf_counter()
        session = BakeSession(BakeJob(snapshot, grid, settings), clock, stopwatch=clock)
        drive(session.bake(), self._should_stop)
        result = session.result
        seconds = time.perf_counter() - started
        predict = getattr(device_cost(), result.capture)
        return {
            "seconds": seconds,
            "capture_again": self._capture_again(session),
            "probes": grid.count,
            "triangles": len(self._snapshot.triangles),
            "face": case["face"],
            "lamps": len(snapshot.lights),
            "capture": result.capture,
            "patches": session.backend.light.count,
            "iterations": result.iterations,
            "converged": result.converged,
            "resident": not any("memory budget" in note for note in result.notes),
            "predicted_capture": predict(grid.count, len(self._snapshot.triangles), case["face"]),
            "phases": clock.phases,
        }

    def _capture_again(self, session: BakeSession) -> float:
        """Seconds that capturing all probes takes when the scene is there: drivers send it with its first use."""
        batches, backend = session._batches, session.backend
        wait_for_gpu()
        started = time.perf_counter()
        for index in range(batches.count):
            surfaces = backend.surfaces(*batches.range(index))
            backend.capture(surfaces, session.result.capture)
        wait_for_gpu()
        return time.perf_counter() - started


def with_lamps(snapshot: SceneSnapshot, count: int) -> SceneSnapshot:
    """The hall with ``count`` small lamps all over it, which share _LAMPS_POWER; as it is where it has as many."""
    if count == len(snapshot.lights):
        return snapshot
    places = np.random.default_rng(0).uniform(_INSET_M, HALL_SIZE_M - _INSET_M, (count, 3))
    lamps = []
    for number, place in enumerate(places):
        matrix = np.eye(4)
        matrix[:3, 3] = place
        lamps.append(Light(f"lamp {number}", "POINT", (_LAMPS_POWER / count,) * 3, matrix, radius=0.03))
    return replace(snapshot, lights=lamps)


def resolution_for(probes: int) -> tuple[int, int, int]:
    """Counts along the hall's axes that give about ``probes`` in cells as cubic as they get."""
    size = HALL_SIZE_M - 2 * _INSET_M
    step = (np.prod(size) / probes) ** (1 / 3)
    tried = [np.maximum(np.rint(size / (step * factor)) + 1, 2).astype(int) for factor in np.linspace(0.7, 1.6, 200)]
    nx, ny, nz = min(tried, key=lambda counts: abs(np.log(np.prod(counts) / probes))).tolist()
    return nx, ny, nz
