# SPDX-License-Identifier: GPL-3.0-or-later
"""``bench frame``, the child's side: the gallery while a light moves, slice by slice, picture by picture."""

from __future__ import annotations

import cProfile
import math
import pstats
import time
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from ..bake.bake_job import BakeJob
from ..bake.job import drive
from ..bake.session import BakeSession
from ..core import camera as cameras
from ..core.conventions import ACTIVE
from ..core.errors import InputError
from ..core.field import Field
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.snapshot import Light, SceneSnapshot
from ..core.view import View
from ..gpu_shaders.context import ensure_context
from ..gpu_shaders.dispatch_profile import limits, profiled
from ..gpu_shaders.live_field import LiveField
from ..gpu_shaders.scene_textures import SceneTextures
from ..gpu_shaders.textures import GpuWait
from ..gpu_shaders.viewport_field import FieldTextures
from ..gpu_shaders.viewport_pass import Picture, ViewportPass
from ..gpu_shaders.viewport_shading import Shading
from ..scene.read import read_scene
from ..viewport.live_bake import LiveBake, Target
from . import bench_scenes
from .bench_measure import report
from .bench_measure_peers import facts_about, load_scene
from .bench_measure_steps import bake_steps
from .bench_phases import PhaseClock

WIDTH, HEIGHT = 1920, 1080
_SLICE_SECONDS = 1 / 60
_LEAST_PICTURES, _MOST_PICTURES = 3, 120
_MODES = {
    "FULL": "picture",
    "NORMALS": "picture without light",
    "DIRECT": "picture, direct light only",
    "INDIRECT": "picture, light of probes only",
}
_SWING_M = 0.4  # radius of the circle that the light moves on
_FUNCTIONS = 14  # of Python that are named
_wait_for_gpu = GpuWait()


def frame(request: dict, reporter, should_stop) -> None:
    """Slices, whole relights, pictures: each as a series of seconds under "run"; then where the time goes."""
    ends = time.perf_counter() + request["seconds"]
    scene = load_scene(request, reporter)
    ensure_context()
    snapshot = read_scene(scene)
    grid = bench_scenes.grid_of(request["scene"], snapshot)
    settings = BakeSettings(**request["settings"])
    reporter.phase("bake")
    live = _Following(snapshot, grid, settings)
    view = _Views(snapshot, live.field)
    live.lead(view)
    facts = facts_about(request["scene"], snapshot, grid)
    facts["scene"] |= {"active": int((live.field.state == ACTIVE).sum()), "lights": len(snapshot.lights)}
    report({**facts, "cold_bake_seconds": live.cold_seconds, "picture": [WIDTH, HEIGHT]})
    _moves(request["moves"], live, view, ends, reporter, should_stop)
    reporter.phase("bakes beside the interface")
    series, longest = bake_steps(scene, grid, settings, should_stop)
    for name, seconds in series.items():
        report({"run": name, **spread(seconds)})
    report({"longest_steps": longest})
    reporter.phase("where the time goes")
    _where_it_goes(snapshot, grid, settings, should_stop)
    reporter.phase("pictures")
    _pictures(view, ends, should_stop)
    reporter.finish()


def _moves(moves: int, live: _Following, view: _Views, ends: float, reporter, should_stop) -> None:
    """A light moves, and its light is followed: series of slices, of whole relights, of handing light to the view."""
    reporter.phase("a light moves", moves)
    series: dict[str, list[float]] = {}
    until = time.perf_counter() + 0.4 * (ends - time.perf_counter())
    for move in range(moves + 2):
        if move == 2:
            series.clear()  # the first two compile shaders and fill caches
        slices = live.follow(move)
        _add(series, "slice", *slices)
        _add(series, "relight, sliced", sum(slices))
        _add(series, "new light to the view", live.lead(view))
        reporter.advance()
        if should_stop() or (move > 4 and time.perf_counter() > until):
            break
    for name, seconds in series.items():
        report({"run": name, **spread(seconds)})


class _Following:
    """The viewport's live light of one volume while its first lamp moves."""

    def __init__(self, snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings):
        self._snapshot, self._settings = snapshot, settings
        self._lights = snapshot.lights
        self._targets = [Target(grid, None)]
        self._live = LiveBake()
        self._lead: LiveField | None = None
        self.cold_seconds = sum(self._work(snapshot, math.inf))

    def follow(self, move: int) -> list[float]:
        """Seconds of every slice until all probes have the light of lamp position ``move``."""
        moved = with_moved_light(self._snapshot, move)
        self._lights = moved.lights
        return self._work(moved, _SLICE_SECONDS)

    def lead(self, view: _Views) -> float:
        """Brings lamps and the newest light to the view at once; seconds."""
        start = time.perf_counter()
        view.set_lights(self._lights)
        if self._lead is None:
            self._lead = LiveField(self._live.backend_of(self.field.grid.name), view.show(self.field))
        self._lead.follow(1.0)
        _wait_for_gpu()
        return time.perf_counter() - start

    def _work(self, snapshot: SceneSnapshot, budget_s: float) -> list[float]:
        self._live.follow(snapshot, self._targets, self._settings, time.perf_counter())
        slices = []
        while self._live.is_working:
            start = time.perf_counter()
            progress = self._live.step(budget_s)
            _wait_for_gpu()
            slices.append(time.perf_counter() - start)
            if self._live.message:
                raise InputError(self._live.message)
            for field in progress.fields.values():  # a whole bake, whose probes may stand elsewhere
                self.field, self._lead = field, None
        return slices


def _pictures(view: _Views, ends: float, should_stop) -> None:
    """Pictures with all light, and with parts of it, one after the other until the time is up."""
    for index, mode in enumerate(_MODES):
        seconds = [view.draw(mode)]
        if index == 0:
            report({"cold_picture_seconds": seconds[0]})
        until = time.perf_counter() + (ends - time.perf_counter()) / (len(_MODES) - index)
        while len(seconds) <= _LEAST_PICTURES or (len(seconds) <= _MOST_PICTURES and time.perf_counter() < until):
            seconds.append(view.draw(mode))
            if should_stop():
                return
        report({"run": _MODES[mode], **spread(seconds[1:])})


def with_moved_light(snapshot: SceneSnapshot, step: int) -> SceneSnapshot:
    """``snapshot`` with its first light on a circle around its place."""
    light = snapshot.lights[0]
    matrix = light.matrix.copy()
    angle = 2 * np.pi * step / 17.0
    matrix[:3, 3] += _SWING_M * np.array([np.cos(angle), np.sin(angle), 0.0])
    return replace(snapshot, lights=[replace(light, matrix=matrix), *snapshot.lights[1:]])


def spread(seconds: list[float]) -> dict:
    """Median, 99th percentile, the longest, number."""
    values = np.asarray(seconds)
    return {
        "median": float(np.median(values)),
        "percentile_99": float(np.percentile(values, 99)),
        "longest": float(values.max()),
        "count": len(values),
    }


def _add(series: dict, name: str, *seconds: float) -> None:
    series.setdefault(name, []).extend(seconds)


class _Views:
    """The picture of the scene's camera, or of one in the volume, as the viewport draws it."""

    def __init__(self, snapshot: SceneSnapshot, field: Field):
        self._origin = field.grid.center
        self._textures = SceneTextures(snapshot, self._origin, np.zeros(len(snapshot.triangles)))
        self._pass = ViewportPass(self._textures, self._origin, len(snapshot.object_names), snapshot.world)
        self._picture = Picture(WIDTH, HEIGHT)
        self._view = View.from_camera(snapshot.camera or cameras.suggest(field, WIDTH / HEIGHT), 0.05, 200.0)

    def set_lights(self, lights: list[Light]) -> None:
        self._textures.set_lights(lights, self._origin)

    def show(self, field: Field) -> FieldTextures:
        """Shows ``field`` instead of what was shown."""
        textures = FieldTextures(field, self._origin)
        self._pass.set_fields([textures])
        return textures

    def draw(self, mode: str = "FULL") -> float:
        """Draws one sample afresh; seconds."""
        self._picture.samples = 0
        start = time.perf_counter()
        self._pass.draw(self._picture, self._view, Shading(mode=mode), None)
        _wait_for_gpu()
        return time.perf_counter() - start


def _where_it_goes(snapshot: SceneSnapshot, grid, settings: BakeSettings, should_stop) -> None:
    """Relights in one go: whole, by phase, by shader, by function of Python."""
    clock = PhaseClock()
    session = BakeSession(BakeJob(snapshot, grid, settings), clock, stopwatch=clock)
    drive(session.bake(), should_stop)
    moves = iter(range(1, 1 << 30))

    def relight(whole: bool = False) -> float:
        """Up to the field on the GPU, or ``whole``, up to the one that files hold."""
        moved = with_moved_light(snapshot, next(moves))
        start = time.perf_counter()
        for steps in (
            session.relight(moved, live=True),
            session.show(),
            *([session.finish()] if whole else []),
        ):
            drive(steps, should_stop)
        _wait_for_gpu()
        return time.perf_counter() - start

    first = [relight() for _ in range(2)]
    count = int(np.clip(4.0 / max(first[-1], 1e-4), 3, 100))
    clock.phases.clear()
    watched = [relight() for _ in range(count)]
    phases = {name: seconds / count for name, seconds in clock.phases.items()}
    clock.is_watching = False
    report(
        {
            "run": "relight, in one go",
            **spread([relight() for _ in range(count)]),
            "watched_seconds": float(np.median(watched)),
            "phases": phases,
            "patches": session.backend.light.count,
            "iterations": session.result.iterations,
        }
    )
    report({"run": "the same, field read back", **spread([relight(whole=True) for _ in range(count)])})
    device = limits()
    texel_layers = dict.fromkeys(("geometry", "albedo", "emission"), len(session._batches.nodes))
    with profiled(texel_layers) as costs:
        profiled_seconds = [relight() for _ in range(count)]
    report(
        {
            "limits": asdict(device),
            "profiled_seconds": float(np.median(profiled_seconds)),
            "shaders": {
                name: {key: value / count for key, value in asdict(cost).items()} for name, cost in costs.items()
            },
        }
    )
    profile = cProfile.Profile()
    profile.enable()
    for _ in range(count):
        relight()
    profile.disable()
    report({"functions": _slowest(pstats.Stats(profile), count)})


def _slowest(stats: pstats.Stats, count: int) -> list[dict]:
    """The functions with the most time of their own, per relight."""
    rows = [
        {
            "function": f"{Path(file).name}:{name}" if file != "~" else name,
            "calls": calls / count,
            "own_seconds": own / count,
            "whole_seconds": whole / count,
        }
        for (file, _line, name), (_, calls, own, whole, _callers) in vars(stats)["stats"].items()
    ]
    return sorted(rows, key=lambda row: -row["own_seconds"])[:_FUNCTIONS]
