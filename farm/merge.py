# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm merge``: after iteration 0 the barrier, after iteration 1 the probe files. Needs neither Blender nor
a GPU."""

from __future__ import annotations

from pathlib import Path

from ..core.errors import InputError
from .job import ITERATIONS, Job

HELP = "merges votes after iteration 0, and light into probe files after iteration 1"
NEEDS_BLENDER = NEEDS_GPU = False


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("job", metavar="JOB", help="folder of the job")
    parser.add_argument(
        "--iteration", metavar="I", type=int, default=ITERATIONS - 1, help="that is over (default %(default)s)"
    )
    parser.add_argument(
        "--without", metavar="S,S", default="", help="shards that may be missing: their probes become invalid"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def run(args, reporter, should_stop):
    from ..cli.progress import Reporter
    from .votes import merge_votes

    if not 0 <= args.iteration < ITERATIONS:
        raise InputError(f"--iteration is {args.iteration}; it is 0 or 1")
    job = Job(args.job)
    without = {job.shard(_number(text)).number for text in args.without.split(",") if text}
    if args.iteration == 0:
        reporter.phase("votes", len(job.groups))
        for group in job.groups:
            merge_votes(job, group, without)
            reporter.advance()
        return {"merged": len(job.groups)}, 0
    files, summaries, status = [], [], 0
    reporter.phase("merge", len(job.groups))
    for number in range(len(job.plan["frames"])):
        own = Reporter(quiet=args.quiet)  # warnings belong to their frame
        paths, entries, settled = _merge_frame(job, number, without, own)
        files += [str(path) for path in paths]
        summaries += entries
        status = status if settled else 4
        reporter.advance(len(paths))
    return {"files": files, "volumes": summaries}, status


def _number(text: str) -> int:
    if not text.strip().isdecimal():
        raise InputError(f"--without names '{text}'; give numbers of shards, separated by commas")
    return int(text)


def _merge_frame(job: Job, number: int, without: set[int], reporter) -> tuple[list[Path], list[dict], bool]:
    """The probe files of a frame, as ``bake`` would write them; an entry for each; whether their light settled."""
    from ..bake.result import BakeResult, report_on
    from ..formats import probe_file, probe_metadata
    from ..formats.file_names import volume_endings
    from ..formats.staging import StagedFolder
    from .settings import settings_of

    frame, settings = job.plan["frames"][number], settings_of(job.plan)
    for warning in frame["warnings"]:
        reporter.warn(warning)
    results, entries, settled = [], [], True
    for volume in range(len(frame["volumes"])):
        result = BakeResult(warnings=list(frame["volumes"][volume]["warnings"]))
        grid, lost = _finish(job, (number, volume), without, result, settings)
        for shard in lost:
            reporter.warn(f"{job.describe(shard)} is missing: its probes are marked invalid")
        settled &= report_on(result, grid, settings, reporter)
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
    endings = volume_endings([result.field.grid.name for result in results])
    with StagedFolder(folder) as staged:
        for ending, result in zip(endings, results):
            result.field.metadata = {
                **result.field.metadata,
                **probe_metadata.stated(
                    frame["scene_name"],
                    frame["frame"],
                    frame["scene_hash"],
                    settings,
                    job.plan["device"],
                    result.iterations,
                    result.converged,
                    reporter.warnings,
                ),
            }
            probe_file.write(staged.path(f"probes{ending}.exr"), result.field)
    return [folder / f"probes{ending}.exr" for ending in endings], entries, settled


def _finish(job: Job, group: tuple[int, int], without: set[int], result, settings):
    """Fills ``result`` with the field of ``group``; returns its grid and the shards that are missing."""
    from ..bake.finish import complete, tell
    from .outcomes import read_outcomes
    from .settings import volume_of

    grid, state, edits = volume_of(job, group)
    outcomes: list = []
    lost: list = []
    missing: list = []
    for shard in job.shards_of(group):
        path = job.output(1, shard)
        if path is not None:
            outcomes += read_outcomes(path)
        else:
            (lost if shard.number in without else missing).append(shard)
    if missing:
        raise InputError(
            f"{len(missing)} of {len(job.shards)} shards are not done, the first is {job.describe(missing[0])}: run "
            f"'gridlight farm run {job.folder}', or merge --without {','.join(str(s.number) for s in missing)}"
        )
    outcomes.sort(key=lambda pair: pair[0])
    name = job.plan["frames"][group[0]]["scene_name"]
    in_order = [outcome for _, outcome in outcomes]
    tell(result, in_order)
    complete(result, grid, settings, state, edits.offset, in_order, name)
    return grid, lost
