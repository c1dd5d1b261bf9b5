# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of a run, as ``bake``, ``demo`` and ``farm merge`` leave them: probe files, pictures, report. Needs no
Blender by itself; pictures are drawn by whoever has a GPU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..bake.result import BakeResult, is_unsettled
from ..core.conventions import ACTIVE
from ..core.field import state_counts
from ..core.probe_states import invalid_counts
from ..core.ringing import ringing
from ..core.settings import BakeSettings
from ..formats import probe_file, probe_metadata
from ..formats.file_names import volume_endings
from ..formats.report import ReportData, VolumeReport, write_report
from ..formats.staging import StagedFolder
from .run_clock import RunClock

NOT_CONVERGED = 4  # the exit status where light has not settled that should have

# Draws a result into two PNG files: the scene in the field's light, and with its probes.
Draw = Callable[[BakeResult, Path, Path], None]


@dataclass(frozen=True)
class Origin:
    """Where the results of a run come from."""

    title: str  # of the report
    scene_name: str
    frame: int
    scene_hash: str
    device: str
    blender: str  # its version


def write_results(
    origin: Origin,
    settings: BakeSettings,
    results: list[BakeResult],
    folder: StagedFolder,
    reporter,
    stopwatch: RunClock,
    draw: Draw | None,
) -> tuple[dict, int]:
    """Stages probe files, pictures where they are drawn, and report in ``folder``. Returns (summary, exit status)."""
    names = volume_endings([result.field.grid.name for result in results])
    images: list[tuple[str, bytes]] = []
    with stopwatch("write"):
        reporter.phase("write")
        for name, result in zip(names, results):
            result.field.metadata |= _provenance(origin, settings, result, reporter.warnings)
            probe_file.write(folder.path(f"probes{name}.exr"), result.field)
        if draw is not None:
            reporter.phase("pictures", len(results))
            for name, result in zip(names, results):
                images += _pictures(result, name, folder, draw)
                reporter.advance()
    summary = _summary(results, origin.device, settings, stopwatch, reporter)
    report = _report(origin, results, summary, images)
    summary["files"] = [str(folder.folder / name) for name in [*folder.names, "report.html"]]
    write_report(folder.path("report.html"), report)
    return summary, NOT_CONVERGED if any(is_unsettled(result, settings) for result in results) else 0


def _provenance(origin: Origin, settings: BakeSettings, result: BakeResult, warnings: list[str]) -> dict:
    """What a probe file says about how it came to be."""
    stated = probe_metadata.stated(
        origin.scene_name,
        origin.frame,
        origin.scene_hash,
        result.settings or settings,
        origin.device,
        result.iterations,
        result.converged,
        warnings,
    )
    return {**stated, **({"error": result.error} if result.error else {})}


def _pictures(result: BakeResult, ending: str, folder: StagedFolder, draw: Draw) -> list[tuple[str, bytes]]:
    """Draws both pictures of a volume into ``folder``; their titles and bytes for the report."""
    scene, probes = folder.path(f"preview{ending}.png"), folder.path(f"preview_probes{ending}.png")
    draw(result, scene, probes)
    volume = result.field.grid.name
    return [(f"{volume}: direct light and field", scene.read_bytes()), (f"{volume}: probes", probes.read_bytes())]


def _report(origin: Origin, results: list[BakeResult], summary: dict, images: list[tuple[str, bytes]]) -> ReportData:
    volumes = [
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
    ]
    return ReportData(
        title=origin.title,
        settings=summary["settings"],
        device=origin.device,
        blender=origin.blender,
        generator=f"Gridlight {probe_metadata.program_version()}",
        counts=summary["probes"],
        seconds=summary["seconds"],
        warnings=summary["warnings"],
        images=images,
        summary=summary,
        volumes=volumes,
    )


def _summary(results, device: str, settings: BakeSettings, stopwatch: RunClock, reporter) -> dict:
    states = np.concatenate([result.field.state for result in results])
    lit = np.concatenate([result.field.coefficients[result.field.state == ACTIVE] for result in results])
    chosen = [result.settings or settings for result in results]
    return {
        **({"error": _worst_error(results)} if any(result.error for result in results) else {}),
        "probes": state_counts(states),
        "invalid_because": invalid_counts([result.field for result in results]),
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
