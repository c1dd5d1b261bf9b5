# SPDX-License-Identifier: GPL-3.0-or-later
"""Part of ``bench frame``: how long Blender waits for each step of a bake that runs beside its interface.

It is the operator's own job (``operators.bake_task``), driven as its timer drives it. The GPU is waited for after every
step, because the next redraw would.
"""

from __future__ import annotations

import time

import bpy

from .. import operators
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.steps import STEP_SECONDS
from ..gpu_shaders.textures import wait_for_gpu
from ..operators.bake_task import BakeTask
from ..operators.volume_choice import volumes_of
from ..scene.volumes import create_volume

_WARM_BAKES = 5


def bake_steps(
    scene: bpy.types.Scene, grid: Grid, settings: BakeSettings, should_stop
) -> tuple[dict[str, list[float]], dict[str, float]]:
    """Bakes all volumes of ``scene``, or one of ``grid`` where it has none, once and then some times warm.

    Returns:
        Series of seconds, of steps and of timer events, which hold as many steps as there is time for; and the
        longest warm step of each phase.
    """
    if not hasattr(bpy.types.Scene, "gridlight"):
        operators.register()
    if not volumes_of(scene):
        create_volume(scene, grid.name, grid.matrix, grid.resolution)
        scene.view_layers[0].update()
    _choose(scene.gridlight, settings)  # type: ignore[attr-defined]  # a property of ours
    series: dict[str, list[float]] = {}
    longest: dict[str, float] = {}
    for bake in range(1 + _WARM_BAKES):
        steps, events, phases = _bake(scene, should_stop)
        kind = "first bake" if bake == 0 else "bake"
        series.setdefault(f"{kind}, step", []).extend(steps)
        series.setdefault(f"{kind}, timer event", []).extend(events)
        if bake:
            longest = {name: max(longest.get(name, 0.0), seconds) for name, seconds in phases.items()}
    return series, longest


def _choose(properties, settings: BakeSettings) -> None:
    """Sets what an artist would set in the panel."""
    properties.bounces_auto = settings.bounces is None
    for name, value in vars(settings).items():
        if hasattr(properties, name) and value is not None:
            setattr(properties, name, value)


def _bake(scene: bpy.types.Scene, should_stop) -> tuple[list[float], list[float], dict[str, float]]:
    """Seconds of its steps and events, and of the longest step of each phase."""
    task = BakeTask(scene, scene.view_layers[0], volumes_of(scene))
    steps: list[float] = []
    events: list[float] = []
    phases: dict[str, float] = {}
    while True:
        event_began = time.perf_counter()
        try:
            while time.perf_counter() < event_began + STEP_SECONDS:
                phase, began = task.progress.phase_name, time.perf_counter()
                next(task)
                wait_for_gpu()
                steps.append(time.perf_counter() - began)
                phases[phase] = max(phases.get(phase, 0.0), steps[-1])
        except StopIteration:
            return steps, events, phases
        events.append(time.perf_counter() - event_began)
        if should_stop():
            task.stop("stopped")
