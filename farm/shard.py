# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm shard``: makes the outputs of one shard, or of a share of all, in this process."""

from __future__ import annotations

from ..core.errors import Cancelled, InputError
from .job import ITERATIONS, Job, Shard

HELP = "makes one shard's output of one iteration; does nothing where it is there"
NEEDS_BLENDER = NEEDS_GPU = True


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("job", metavar="JOB", help="folder of the job")
    parser.add_argument(
        "--iteration", metavar="I", type=int, required=True, help="0: capture and vote; 1, after the barrier: light"
    )
    parser.add_argument(
        "--shard",
        metavar="S|K/N",
        required=True,
        help="number of the shard, from 0; or K/N: the share K, from 0, of N equal ones, which may be none",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def check(args) -> None:
    """What can be refused before Blender starts."""
    if not 0 <= args.iteration < ITERATIONS:
        raise InputError(f"--iteration is {args.iteration}; it is 0 or 1")
    chosen(Job(args.job), args.shard)


def chosen(job: Job, text: str) -> list[Shard]:
    """The shards that ``--shard`` names."""
    number, _, count = text.partition("/")
    if not number.isdecimal() or ("/" in text and not (count.isdecimal() and int(number) < int(count))):
        raise InputError(f"--shard is '{text}'; give a number from 0, or K/N with K from 0 to N − 1")
    return job.shards[int(number) :: int(count)] if count else [job.shard(int(number))]


def run(args, reporter, should_stop):
    from ..gpu_shaders.context import ensure_context
    from .shards import ShardRunner

    check(args)
    job = Job(args.job)
    shards = chosen(job, args.shard)
    if not shards:
        reporter.note(f"nothing to do: the job has {len(job.shards)} shards, none is in share {args.shard}")
        return {"done": []}, 0
    ensure_context()
    runner = ShardRunner(job)
    done = []
    reporter.phase(f"iteration {args.iteration}", len(shards))
    for shard in shards:
        if should_stop():
            raise Cancelled("cancelled; shards that are done stay done")
        done.append(runner.run(args.iteration, shard.number))
        reporter.advance()
    return {"done": done}, 0
