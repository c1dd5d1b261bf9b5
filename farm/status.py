# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm status``: how far a job is, and what went wrong so far."""

from __future__ import annotations

from .job import ITERATIONS, Job

HELP = "how far a job is, checked file by file"
NEEDS_BLENDER = NEEDS_GPU = False


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("job", metavar="JOB", help="folder of the job")
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def run(args, reporter, should_stop):
    job = Job(args.job)
    done = [[job.output(iteration, shard) is not None for shard in job.shards] for iteration in range(ITERATIONS)]
    events = job.events()
    counts = {kind: sum(event["event"] == kind for event in events) for kind in ("failed", "damaged", "poison")}
    verdicts = sum(job.verdict(group) is not None for group in job.groups)
    for iteration, name in enumerate(("votes", "light")):
        reporter.result(f"iteration {iteration} ({name}): {sum(done[iteration])} of {len(job.shards)} shards done")
        if iteration == 0:
            reporter.result(f"barrier: {verdicts} of {len(job.groups)} volumes and frames merged")
    reporter.result("so far: {failed} failures, {damaged} damaged files, {poison} shards given up".format(**counts))
    return {
        "job": str(job.folder),
        "plan": job.key,
        "shards": len(job.shards),
        "done": [sum(flags) for flags in done],
        "missing": [[i for i, flag in enumerate(flags) if not flag] for flags in done],
        "verdicts": verdicts,
        "results": sorted(str(path) for path in (job.folder / "result").rglob("*.exr")),
        **counts,
    }, 0
