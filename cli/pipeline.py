# SPDX-License-Identifier: GPL-3.0-or-later
"""From a snapshot and its volumes to the files of one run: what ``bake`` and ``demo`` share."""

from __future__ import annotations

from pathlib import Path

import bpy

from ..bake.bake_job import BakeJob
from ..bake.block_session import AnySession, open_session
from ..bake.error_driven import ErrorDrivenBake
from ..bake.job import drive
from ..bake.preview import write_previews
from ..bake.result import BakeResult, check_surfaces, report_on
from ..core.error_budget import ErrorGoal
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..formats import probe_file, probe_metadata
from ..formats.staging import StagedFolder
from ..gpu_shaders.context import device_description, ensure_context
from . import result_files, worker
from .result_files import Origin
from .run_clock import RunClock


def start_gpu(reporter, stopwatch: RunClock) -> None:
    """Makes the GPU context and says so to the parent process."""
    reporter.phase("GPU context")
    with stopwatch("setup"):
        ensure_context()
    worker.milestone(worker.CONTEXT_READY)


def check_snapshot(snapshot: SceneSnapshot, reporter) -> None:
    """Refuses a scene without surfaces and passes on what the reader warns of."""
    check_surfaces(snapshot)
    for warning in snapshot.warnings:
        reporter.warn(warning)


def bake_volumes(
    jobs: list[BakeJob],
    reporter,
    should_stop,
    stopwatch: RunClock,
    goal: ErrorGoal | None = None,
    kept: list[AnySession] | None = None,
) -> list[BakeResult]:
    """Bakes ``jobs`` one after the other, with their settings or as the ``goal`` asks. Appends the sessions to
    ``kept``, which keeps them on the GPU."""
    for job in jobs:
        probe_file.check_size(job.grid, job.settings.bands)
    results = []
    for job in jobs:
        if len(jobs) > 1:
            reporter.note(f"volume '{job.grid.name}'")
        if goal is None:
            session = open_session(job, reporter)
            drive(session.bake(), should_stop)
        else:
            driven = ErrorDrivenBake(job, goal, reporter)
            drive(driven.bake(), should_stop)
            session = driven.session
        result = session.result
        stopwatch.add(result.seconds)
        report_on(result, job.grid, job.settings, reporter)
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
    stopwatch: RunClock,
    pictures: bool = True,
) -> tuple[dict, int]:
    """Stages all files of a bake of ``snapshot`` in ``folder``. Returns (summary, exit status)."""
    origin = Origin(
        title,
        snapshot.name,
        snapshot.frame,
        probe_metadata.scene_hash(snapshot),
        device_description(),
        bpy.app.version_string,
    )

    def draw(result: BakeResult, picture: Path, probes: Path) -> None:
        write_previews(snapshot, result.scene, result.field, picture, probes, should_stop)

    return result_files.write_results(
        origin, settings, results, folder, reporter, stopwatch, draw if pictures else None
    )
