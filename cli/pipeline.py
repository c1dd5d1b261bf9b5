# SPDX-License-Identifier: GPL-3.0-or-later
"""From a snapshot and its volumes to the files of one run: what ``bake`` and ``demo`` share."""

from __future__ import annotations

import importlib.util
import re
import time
from contextlib import contextmanager

import numpy as np

from ..core.conventions import ACTIVE, CULLED, INVALID
from ..core.errors import InputError
from ..core.grid import Grid
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..formats import probe_file, probe_metadata
from ..formats.staging import StagedFolder
from . import worker

PHASES = ("setup", "read", "cull", "capture", "light", "write", "total")
NOT_CONVERGED = 4


class Stopwatch:
    """Seconds per phase of one run."""

    def __init__(self):
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._started = time.perf_counter()

    @contextmanager
    def measure(self, phase: str):
        started = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[phase] += time.perf_counter() - started

    def add(self, seconds: dict) -> None:
        for phase, value in seconds.items():
            self.seconds[phase] += value

    def totals(self) -> dict:
        self.seconds["total"] = time.perf_counter() - self._started
        return {phase: round(self.seconds[phase], 6) for phase in PHASES}


def start_gpu(reporter, stopwatch: Stopwatch) -> None:
    """Makes the GPU context and says so to the parent process. Before 5.2 this needs a session that nothing is open in."""
    from ..gpu_shaders.context import ensure_context

    reporter.phase("GPU context")
    with stopwatch.measure("setup"):
        ensure_context()
    worker.milestone(worker.CONTEXT_READY)


def check_snapshot(snapshot: SceneSnapshot, reporter) -> None:
    """Refuses a scene without surfaces and passes on what the reader warns of."""
    if not len(snapshot.triangles):
        raise InputError(f"scene '{snapshot.name}' has no surface that renders; add a mesh, or enable one for rendering")
    for warning in snapshot.warnings:
        reporter.warn(warning)


def bake_volumes(snapshot: SceneSnapshot, grids: list[Grid], settings: BakeSettings, folder: StagedFolder, reporter, should_stop,
                 stopwatch: Stopwatch) -> tuple[dict, int]:
    """Bakes ``grids`` and stages probe files, pictures and report in ``folder``. Returns (summary, exit status)."""
    from ..bake.job import run_bake
    from ..gpu_shaders.context import device_description

    for grid in grids:
        probe_file.check_size(grid, settings.bands)
    device = device_description()
    results = []
    for grid in grids:
        result = run_bake(snapshot, grid, settings, reporter, should_stop)
        stopwatch.add({phase: value for phase, value in result.seconds.items() if phase in PHASES and phase != "total"})
        for warning in result.warnings:
            reporter.warn(warning)
        for note in result.notes:
            reporter.note(note)
        results.append(result)
    with stopwatch.measure("write"):
        reporter.phase("write")
        for name, result in zip(file_names(grids), results):
            result.field.metadata = {**result.field.metadata, **probe_metadata.provenance(
                snapshot, settings, device, result.iterations, result.converged, reporter.warnings)}
            probe_file.write(folder.path(name), result.field)
        if importlib.util.find_spec("..bake.preview", __package__):  # until it lands
            from ..bake.preview import write_previews

            write_previews(snapshot, [result.field for result in results], folder.path("preview.png"),
                           folder.path("preview_probes.png"))
    summary = _summary(results, device, settings, stopwatch, reporter)
    if importlib.util.find_spec("..formats.report", __package__):  # until it lands
        from ..formats.report import write_report

        write_report(folder.path("report.html"), snapshot, settings, results, summary, preview=folder.staged("preview.png"))
    summary["files"] = [str(folder.folder / name) for name in folder.names]
    converged = all(result.converged for result in results)
    if not converged:
        reporter.warn("the light did not settle within the limit; the files are written and marked. Raise --bounces or "
                      "--tolerance, or lower the reflectance of materials close to 1")
    return summary, 0 if converged else NOT_CONVERGED


def _summary(results, device: str, settings: BakeSettings, stopwatch: Stopwatch, reporter) -> dict:
    states = np.concatenate([result.field.state for result in results])
    return {
        "probes": {"total": len(states), "active": int((states == ACTIVE).sum()), "culled": int((states == CULLED).sum()),
                   "invalid": int((states == INVALID).sum())},
        "iterations": max(result.iterations for result in results),
        "converged": all(result.converged for result in results),
        "seconds": stopwatch.totals(),
        "device": device,
        "settings": settings.as_dict(),
        "files": [],
        "warnings": reporter.warnings,
    }


def file_names(grids: list[Grid]) -> list[str]:
    """``probes.exr`` for one volume, ``probes_<name>.exr`` for several: safe on every file system, and all different."""
    if len(grids) == 1:
        return ["probes.exr"]
    names = []
    taken = set()
    for grid in grids:
        stem = re.sub(r"[^\w.-]+", "_", grid.name).strip("._")[:64] or "volume"
        name, number = stem, 1
        while name.casefold() in taken:  # some file systems do not tell upper from lower case
            number += 1
            name = f"{stem}_{number}"
        taken.add(name.casefold())
        names.append(f"probes_{name}.exr")
    return names
