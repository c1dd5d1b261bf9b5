# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm merge``: after iteration 0 the barrier, after iteration 1 what ``bake`` leaves. Only pictures need
Blender and a GPU."""

from __future__ import annotations

from pathlib import Path

from ..cli import arguments
from ..core.errors import InputError
from .job import ITERATIONS, Job, Shard

HELP = "merges votes after iteration 0, and light into probe files, pictures and a report after iteration 1"
NEEDS_GPU = True


def NEEDS_BLENDER(args) -> bool:
    return args.iteration == ITERATIONS - 1 and args.pictures


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("job", metavar="JOB", help="folder of the job")
    parser.add_argument(
        "--iteration", metavar="I", type=int, default=ITERATIONS - 1, help="that is over (default %(default)s)"
    )
    parser.add_argument(
        "--without", metavar="S,S", default="", help="shards that may be missing: their probes become invalid"
    )
    arguments.add_pictures(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def check(args) -> None:
    """What can be refused before Blender starts: also that shards are missing."""
    if not 0 <= args.iteration < ITERATIONS:
        raise InputError(f"--iteration is {args.iteration}; it is 0 or 1")
    job = Job(args.job)
    without = _without(job, args)
    if args.iteration == 1:
        for group in job.groups:
            _outputs(job, group, without)


def run(args, reporter, should_stop):
    from .results import merge_frame
    from .votes import merge_votes

    job = Job(args.job)
    without = _without(job, args)
    if args.iteration == 0:
        reporter.phase("votes", len(job.groups))
        for group in job.groups:
            merge_votes(job, group, without)
            reporter.advance()
        return {"merged": len(job.groups)}, 0
    if args.pictures:
        from ..cli import pipeline
        from ..cli.run_clock import RunClock

        pipeline.start_gpu(reporter, RunClock())
    files, entries, status = [], [], 0
    reporter.phase("merge", len(job.groups))
    for number in range(len(job.plan["frames"])):
        outputs = {group: _outputs(job, group, without) for group in job.groups if group[0] == number}
        summary, frame_status = merge_frame(job, number, outputs, args, should_stop)
        files += summary["files"]
        entries += summary["volumes"]
        status = max(status, frame_status)
        reporter.advance(len(outputs))
    return {"files": files, "volumes": entries}, status


def _without(job: Job, args) -> set[int]:
    return {job.shard(_number(text)).number for text in args.without.split(",") if text}


def _number(text: str) -> int:
    if not text.strip().isdecimal():
        raise InputError(f"--without names '{text}'; give numbers of shards, separated by commas")
    return int(text)


def _outputs(job: Job, group: tuple[int, int], without: set[int]) -> tuple[list[Path], list[Shard]]:
    """The outputs of iteration 1 of ``group``, and the shards of ``without`` that have none."""
    paths: list[Path] = []
    lost: list[Shard] = []
    missing: list[Shard] = []
    for shard in job.shards_of(group):
        path = job.output(1, shard)
        if path is not None:
            paths.append(path)
        else:
            (lost if shard.number in without else missing).append(shard)
    if missing:
        raise InputError(
            f"{len(missing)} of {len(job.shards)} shards are not done, the first is {job.describe(missing[0])}: run "
            f"'gridlight farm run {job.folder}', or merge --without {','.join(str(s.number) for s in missing)}"
        )
    return paths, lost
