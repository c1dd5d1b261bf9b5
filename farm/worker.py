# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm worker``: one Dask worker with one Blender process; start one for each GPU of the farm."""

from __future__ import annotations

import asyncio
import logging

from ..cli import system_libraries
from ..core.errors import InputError, NoGpuError
from . import tasks

HELP = "serves a Dask scheduler; one for each GPU of the farm"
NEEDS_BLENDER = NEEDS_GPU = False


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("scheduler", metavar="ADDRESS", help="of the Dask scheduler, such as tcp://farm:8786")
    parser.add_argument("--name", metavar="NAME", help="of this worker in reports (default: its address)")


def run(args, reporter, should_stop):
    import dask
    from distributed import Worker

    need_libraries(reporter)
    logging.getLogger("distributed").setLevel(logging.ERROR)
    dask.config.set({"distributed.worker.daemon": False})

    async def serve() -> None:
        worker = Worker(
            args.scheduler,
            nthreads=1,
            name=args.name,
            memory_limit=0,
            dashboard=False,
            death_timeout=30,
            validate=False,
        )
        async with worker:
            reporter.note(f"worker {worker.name} serves {args.scheduler}")
            await worker.finished()

    try:
        asyncio.run(serve())
    except (OSError, TimeoutError, ValueError) as error:
        raise InputError(f"no Dask scheduler answers at {args.scheduler} ({error}); start one, or check it") from None
    finally:
        tasks.end()
    return {"served": args.scheduler}, 0


def need_libraries(reporter) -> None:
    """Raises NoGpuError where this machine lacks what Blender needs and it cannot be installed."""
    problem = system_libraries.ensure(reporter.note)
    if problem:
        raise NoGpuError(problem)
