# SPDX-License-Identifier: GPL-3.0-or-later
"""From the outputs of a frame's shards to what ``bake`` would have left of it: the same probe files byte for byte,
pictures and a report. Needs no Blender where no pictures are drawn."""

from __future__ import annotations

from pathlib import Path

from ..bake.finish import complete, tell
from ..bake.result import BakeResult, report_on
from ..cli.progress import Reporter
from ..cli.result_files import Draw, Origin, write_results
from ..cli.run_clock import RunClock
from ..formats.staging import StagedFolder
from .job import Job, Shard
from .outcomes import read_outcomes
from .scene_file import SceneReader
from .settings import settings_of, volume_of

_PHASES = ("capture", "light")  # of a bake, that the iterations correspond to


def merge_frame(
    job: Job, number: int, outputs: dict[tuple[int, int], tuple[list[Path], list[Shard]]], args, should_stop
) -> tuple[dict, int]:
    """Writes the results of frame ``number`` from the ``outputs`` of its groups and the shards that are lost.

    Returns a summary (``files``, ``volumes``) and the exit status.
    """
    reporter = Reporter(quiet=args.quiet)  # warnings belong to their frame
    frame, settings = job.plan["frames"][number], settings_of(job.plan)
    for warning in frame["warnings"]:
        reporter.warn(warning)
    results, entries = [], []
    for group, (paths, lost) in sorted(outputs.items()):
        result = BakeResult(warnings=list(frame["volumes"][group[1]]["warnings"]))
        grid = _finish(job, group, paths, result, settings)
        for shard in lost:
            reporter.warn(f"{job.describe(shard)} is missing: its probes are marked invalid")
        report_on(result, grid, settings, reporter)
        results.append(result)
        entries.append(
            {
                "frame": frame["frame"],
                "volume": grid.name,
                "probes": result.counts,
                "iterations": result.iterations,
                "converged": result.converged,
                "missing_shards": [shard.number for shard in lost],
            }
        )
    folder = job.folder / "result"
    if len(job.plan["frames"]) > 1:
        folder /= f"frame_{frame['frame']:04d}"
    origin = Origin(
        job.plan["title"],
        frame["scene_name"],
        frame["frame"],
        frame["scene_hash"],
        job.plan["device"],
        job.plan["blender"],
    )
    stopwatch = RunClock()
    stopwatch.add(_worker_seconds(job, number))
    draw = _drawing(job, frame, should_stop) if args.pictures else None
    with StagedFolder(folder) as staged:
        summary, status = write_results(origin, settings, results, staged, reporter, stopwatch, draw)
    return {"files": summary["files"], "volumes": entries}, status


def _finish(job: Job, group: tuple[int, int], paths: list[Path], result: BakeResult, settings):
    """Fills ``result`` with the field of ``group``; returns its grid."""
    grid, state, edits = volume_of(job, group)
    outcomes = sorted((pair for path in paths for pair in read_outcomes(path)), key=lambda pair: pair[0])
    in_order = [outcome for _, outcome in outcomes]
    tell(result, in_order)
    complete(result, grid, settings, state, edits.offset, in_order, job.plan["frames"][group[0]]["scene_name"])
    return grid


def _worker_seconds(job: Job, number: int) -> dict[str, float]:
    """Seconds of all workers together by phase, of the shards of a frame as they were last made."""
    last = {(event["iteration"], event["shard"]): event for event in job.events() if event["event"] == "done"}
    seconds = dict.fromkeys(_PHASES, 0.0)
    for (iteration, shard), event in last.items():
        if job.shards[shard].frame == number:
            seconds[_PHASES[iteration]] += event["seconds"]
    return seconds


def _drawing(job: Job, frame: dict, should_stop) -> Draw:
    """Draws results of ``frame`` with the scene that travels with the job, which is read when it is needed."""
    from ..bake.preview import write_previews
    from ..core.emitters import sampling_density
    from ..gpu_shaders.scene_textures import SceneTextures

    snapshot = SceneReader(job.objects).read(frame["scene"])

    def draw(result: BakeResult, picture: Path, probes: Path) -> None:
        grid = result.field.grid
        scene = SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
        write_previews(snapshot, scene, result.field, picture, probes, should_stop)

    return draw
