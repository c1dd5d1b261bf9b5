# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm run``: all shards of a job on Dask workers, then the merge."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
from pathlib import Path

from ..cli import arguments
from ..core.errors import Cancelled, InputError, NoGpuError
from .blender_process import BLENDER_PYTHON
from .job import Job
from .worker import need_libraries

HELP = "runs a job on Dask workers, goes on where it was interrupted, and merges"
NEEDS_BLENDER = NEEDS_GPU = False
INCOMPLETE = 4  # the exit status where files are written and marked


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("job", metavar="JOB", help="folder of the job; workers elsewhere must see it under this path")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", metavar="N", type=int, help="start N workers on this machine (default 1)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="use the workers of this Dask scheduler")
    parser.add_argument(
        "--timeout", metavar="S", type=float, default=3600.0, help="seconds that a shard may take (default %(default)g)"
    )
    arguments.add_pictures(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress; warnings stay")


def check(args) -> None:
    if args.workers is not None and not 1 <= args.workers <= 1024:
        raise InputError(f"--workers is {args.workers}; it must lie between 1 and 1024")
    if not args.timeout > 0:
        raise InputError(f"--timeout is {args.timeout:g}; it must be greater than 0 seconds")


def run(args, reporter, should_stop):
    from .dispatch import Dispatcher

    job = Job(Path(args.job).absolute())
    if args.scheduler is None:
        need_libraries(reporter)
    _silence_dask()
    pool = _LocalPool(args.workers or 1, reporter) if args.scheduler is None else _RemotePool(args.scheduler)
    try:
        with pool:
            poison = Dispatcher(job, pool, reporter, args.timeout).follow()
    except KeyboardInterrupt:
        reporter.abandon()
        reporter.note(f"what is done stays done: 'gridlight farm run {args.job}' goes on from here")
        raise Cancelled("cancelled") from None
    return _merge(job, sorted(poison), args, reporter)


def _silence_dask() -> None:
    """What Dask logs, tracebacks among it, is told by the dispatcher in a line. Importing it sets the levels of its
    loggers."""
    import distributed  # noqa: F401

    for name in list(logging.root.manager.loggerDict):
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)


def _merge(job: Job, poison: list[int], args, reporter):
    """Merges in Blender's environment, where numpy and OpenEXR are."""
    command = [os.environ.get(BLENDER_PYTHON, sys.executable), "-I", str(Path(__file__).with_name("__main__.py"))]
    command += ["merge", str(job.folder), *(["--without", ",".join(map(str, poison))] if poison else [])]
    command += ["--quiet"] * args.quiet

    def merged(*options: str):
        return subprocess.run([*command, *options], stdout=subprocess.PIPE, text=True, check=False)

    done = merged(*["--no-pictures"] * (not args.pictures))
    if done.returncode == NoGpuError.exit_status and args.pictures:
        reporter.note("no pictures are drawn here; 'gridlight farm merge' draws them where there is a GPU")
        done = merged("--no-pictures")
    if done.returncode not in (0, 4):
        raise InputError(f"the shards of {job.folder} could not be merged; the line above says why")
    summary = json.loads(done.stdout.splitlines()[-1])
    return {**summary, "poison": poison}, INCOMPLETE if poison else done.returncode


class _RemotePool:
    """Workers of a scheduler elsewhere."""

    def __init__(self, address: str):
        self._address = address

    def __enter__(self):
        from distributed import Client

        try:
            self.client = Client(self._address, timeout=20, set_as_default=False)
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(f"no Dask scheduler answers at {self._address} ({error}); start or check it") from None
        return self

    def __exit__(self, *_error):
        self.client.close()

    def look_after(self) -> None:
        """Whoever started these workers looks after them."""


class _LocalPool:
    """A scheduler in this process and workers on this machine. Workers that end are replaced."""

    def __init__(self, count: int, reporter):
        self._count, self._reporter = count, reporter
        self._started = 0

    def __enter__(self):
        import dask
        from distributed import Client, LocalCluster

        # A task whose worker died is not tried again by Dask: the dispatcher counts and names it.
        dask.config.set({"distributed.scheduler.allowed-failures": 0, "distributed.scheduler.worker-ttl": "60s"})
        self._cluster = LocalCluster(
            n_workers=0,
            processes=False,
            protocol="tcp://",
            host="127.0.0.1",
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        )
        self.client = Client(self._cluster, set_as_default=False)
        self._processes = [self._start() for _ in range(self._count)]
        return self

    def __exit__(self, *_error):
        for process in self._processes:
            process.terminate()
        self.client.close()
        self._cluster.close()
        for process in self._processes:
            try:
                process.wait(5)
            except subprocess.TimeoutExpired:
                process.kill()

    def look_after(self) -> None:
        """Replaces workers that ended."""
        for index, process in enumerate(self._processes):
            code = process.poll()
            if code is not None:
                how = signal.Signals(-code).name if code < 0 else f"status {code}"
                self._reporter.note(f"a worker (process {process.pid}) ended with {how}; another one is started")
                self._processes[index] = self._start()

    def _start(self) -> subprocess.Popen:
        if self._started > self._count + 100:
            raise InputError("workers end as soon as they start; run 'gridlight farm worker ADDRESS' to see why")
        self._started += 1
        start = Path(__file__).with_name("__main__.py")
        return subprocess.Popen(
            [sys.executable, "-I", str(start), "worker", self._cluster.scheduler_address],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            process_group=0,
        )
