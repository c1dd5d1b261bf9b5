# SPDX-License-Identifier: GPL-3.0-or-later
"""From a snapshot and its volumes to the files of one run: what ``bake`` and ``demo`` share."""

from __future__ import annotations

import time
from contextlib import contextmanager

import bpy
import numpy as np

from ..bake.block_session import AnySession, open_session
from ..bake.error_driven import ErrorDrivenBake
from ..bake.job import drive
from ..bake.preview import write_previews
from ..bake.result import BakeResult, is_unsettled, report_on
from ..core.conventions import ACTIVE, CULLED, INVALID
from ..core.error_budget import ErrorGoal
from ..core.errors import InputError
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.ringing import ringing
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..formats import probe_file, probe_metadata
from ..formats.file_names import volume_endings
from ..formats.report import ReportData, VolumeReport, write_report
from ..formats.staging import StagedFolder
from ..gpu_shaders.context import device_description, ensure_context
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
    """Makes the GPU context and says so to the parent process."""
    reporter.phase("GPU context")
    with stopwatch.measure("setup"):
        ensure_context()
    worker.milestone(worker.CONTEXT_READY)


def check_snapshot(snapshot: SceneSnapshot, reporter) -> None:
    """Refuses a scene without surfaces and passes on what the reader warns of."""
    if not len(snapshot.triangles):
        raise InputError(f"scene '{snapshot.name}' has no surface that renders; add a mesh or enable one for rendering")
    for warning in snapshot.warnings:
        reporter.warn(warning)


def bake_volumes(
    snapshot: SceneSnapshot,
    grids: list[Grid],
    settings: BakeSettings,
    reporter,
    should_stop,
    stopwatch: Stopwatch,
    edits: list[ProbeEdits | None] | None = None,
    kept: list[AnySession] | None = None,
    goal: ErrorGoal | None = None,
) -> list[BakeResult]:
    """Bakes ``grids`` one after the other, each with its ``edits``, with ``settings`` or as the ``goal`` asks. Appends
    the sessions to ``kept``, which keeps them on the GPU."""
    for grid in grids:
        probe_file.check_size(grid, settings.bands)
    results = []
    for grid, edit in zip(grids, edits or [None] * len(grids)):
        if len(grids) > 1:
            reporter.note(f"volume '{grid.name}'")
        if goal is None:
            session = open_session(snapshot, grid, settings, reporter, edit)
            drive(session.bake(), should_stop)
        else:
            driven = ErrorDrivenBake(snapshot, grid, settings, goal, reporter, edit)
            drive(driven.bake(), should_stop)
            session = driven.session
        result = session.result
        stopwatch.add(result.seconds)
        report_on(result, grid, settings, reporter)
        results.append(result)
        if kept is not None:
            kept.append(session)
    return results


def write_results(
    title: str,
    snapshot: SceneSnapshot,
    settings: BakeSettings,
    results: list[BakeResult],
    folder: StagedFolder,
    reporter,
    should_stop,
    stopwatch: Stopwatch,
) -> tuple[dict, int]:
    """Stages probe files, pictures and report in ``folder``. Returns (summary, exit status)."""
    device = device_description()
    names = volume_endings([result.field.grid.name for result in results])
    images = []
    with stopwatch.measure("write"):
        reporter.phase("write")
        for name, result in zip(names, results):
            result.field.metadata = {
                **result.field.metadata,
                **probe_metadata.provenance(
                    snapshot,
                    result.settings or settings,
                    device,
                    result.iterations,
                    result.converged,
                    reporter.warnings,
                ),
                **({"error": result.error} if result.error else {}),
            }
            probe_file.write(folder.path(f"probes{name}.exr"), result.field)
        reporter.phase("pictures", len(results))
        for name, result in zip(names, results):
            pictures = folder.path(f"preview{name}.png"), folder.path(f"preview_probes{name}.png")
            write_previews(snapshot, result.scene, result.field, *pictures, should_stop)
            volume = result.field.grid.name
            images += [
                (f"{volume}: direct light and field", pictures[0].read_bytes()),
                (f"{volume}: probes", pictures[1].read_bytes()),
            ]
            reporter.advance()
    summary = _summary(results, device, settings, stopwatch, reporter)
    report = ReportData(
        title=title,
        settings=summary["settings"],
        device=device,
        blender=bpy.app.version_string,
        generator=f"Gridlight {probe_metadata.program_version()}",
        counts=summary["probes"],
        seconds=summary["seconds"],
        warnings=reporter.warnings,
        images=images,
        summary=summary,
        volumes=[
            VolumeReport(
                result.field,
                result.field.grid.name,
                result.energy,
                result.change,
                result.iterations,
                result.converged,
                result.notes,
                result.error,
            )
            for result in results
        ],
    )
    summary["files"] = [str(folder.folder / name) for name in [*folder.names, "report.html"]]
    write_report(folder.path("report.html"), report)
    return summary, NOT_CONVERGED if any(is_unsettled(result, settings) for result in results) else 0


def _summary(results, device: str, settings: BakeSettings, stopwatch: Stopwatch, reporter) -> dict:
    states = np.concatenate([result.field.state for result in results])
    lit = np.concatenate([result.field.coefficients[result.field.state == ACTIVE] for result in results])
    chosen = [result.settings or settings for result in results]
    return {
        **({"error": _worst_error(results)} if any(result.error for result in results) else {}),
        "probes": {
            "total": len(states),
            "active": int((states == ACTIVE).sum()),
            "culled": int((states == CULLED).sum()),
            "invalid": int((states == INVALID).sum()),
        },
        "iterations": max(result.iterations for result in results),
        "converged": all(result.converged for result in results),
        "ringing": ringing(lit).as_dict(),
        "seconds": stopwatch.totals(),
        "device": device,
        "settings": chosen[0].as_dict() if len(chosen) == 1 else settings.as_dict(),
        "files": [],
        "warnings": reporter.warnings,
    }


def _worst_error(results: list[BakeResult]) -> dict:
    """What error-driven bakes predict: of the volume that is furthest off, and of each where there are several."""
    volumes = [{"volume": result.field.grid.name, **result.error} for result in results]
    worst = max(volumes, key=lambda error: np.inf if error["predicted"] is None else error["predicted"])
    return {**worst, "volumes": volumes} if len(volumes) > 1 else results[0].error
