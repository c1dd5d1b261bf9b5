# SPDX-License-Identifier: GPL-3.0-or-later
"""Which worker does what when: iteration 0 of a volume, its barrier, iteration 1; failures, retries, progress.

A worker has one task at a time, so a task that takes its worker down is known by name. It is preferably given what its
Blender process has on the GPU: the blocks that it captured, in iteration 1 and at the next frame. Everything that is
done lies in the job's folder; of this object nothing needs to survive.
"""

from __future__ import annotations

import queue
import time
import uuid
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..core.errors import InputError
from .blender_process import WorkerRefused
from .job import Job, Shard

TRIES = 3
_POLL_SECONDS = 0.25
_VOTES_SECONDS = 600.0
_SAY_SECONDS = 15.0  # without any worker until that is said


@dataclass(frozen=True)
class Work:
    """A shard's ``iteration``, or the barrier of ``group`` where ``shard`` is None."""

    group: tuple[int, int]
    iteration: int
    shard: Shard | None = None


class Dispatcher:
    """Follows ``job`` to its end on the workers of ``pool`` (``client``, ``look_after``)."""

    def __init__(self, job: Job, pool, reporter, timeout_seconds: float):
        self._job, self._pool, self._reporter, self._timeout = job, pool, reporter, timeout_seconds
        self._waiting: list[Work] = []
        self._running: dict[str, tuple[Work, Any]] = {}  # by worker, with the future
        self._finished: queue.Queue = queue.Queue()
        self._tries: dict[Work, int] = {}
        self._owner: dict[tuple, str] = {}  # worker that captured blocks last, by volume and blocks
        self._refused: set[str] = set()
        self._refusal = ""  # why the last one did
        self._poison: set[int] = set()
        self._alone_since: float | None = None

    def follow(self) -> set[int]:
        """Does what is not done; returns the numbers of shards that were given up.

        Raises:
            InputError: votes cannot be merged, every worker refused, or the scheduler has gone.
        """
        for group in self._job.groups:
            self._advance(group)
        later = [group for group in self._job.groups if not self._is_decided(group)]  # iteration 1 is still to come
        remaining = len(self._waiting) + sum(len(self._job.shards_of(group)) for group in later)
        remaining += sum(Work(group, 0) not in self._waiting for group in later)
        already = 2 * len(self._job.shards) + len(self._job.groups) - remaining
        if already > 0:
            self._reporter.note(f"{already} of {already + remaining} outputs are there already")
            self._job.event("resumed", there=already)
        self._reporter.phase("shards", remaining)
        while self._waiting or self._running:
            self._pool.look_after()
            self._assign()
            self._collect()
        self._reporter.finish()
        return self._poison

    def _is_decided(self, group: tuple[int, int]) -> bool:
        """Is there a verdict by all shards that can vote?"""
        voters = {shard.number for shard in self._job.shards_of(group)} - self._poison
        return bool(voters) and voters <= self._job.voted(group)

    def _advance(self, group: tuple[int, int]) -> None:
        """Puts what ``group`` can do next on the list, unless it is there or being done."""
        shards = [shard for shard in self._job.shards_of(group) if shard.number not in self._poison]
        iteration = 1 if self._is_decided(group) else 0
        due = [Work(group, iteration, shard) for shard in shards if self._job.output(iteration, shard) is None]
        if iteration == 0 and not due and shards:
            due = [Work(group, 0)]
        busy = {work for work, _ in self._running.values()}
        self._waiting += [work for work in due if work not in busy and work not in self._waiting]

    # Workers
    # ------------------------------------------------------------------------------------------------------------------

    def _assign(self) -> None:
        alive = self._workers() - self._refused
        for address in [address for address in self._running if address not in alive]:
            work, future = self._running.pop(address)
            future.cancel()
            self._failed(work, address, "its worker was lost")
        self._say_whether_alone(alive)
        for address in sorted(alive - set(self._running)):
            work = self._choose(address, alive)
            if work is None:
                continue
            self._waiting.remove(work)
            request = (
                {"votes": list(work.group), "without": sorted(self._poison)}
                if work.shard is None
                else {"iteration": work.iteration, "shard": work.shard.number}
            )
            future = self._pool.client.submit(
                _execute,
                str(self._job.folder),
                request,
                self._timeout if work.shard else _VOTES_SECONDS,
                key=f"gridlight-{uuid.uuid4()}",
                workers=[address],
                allow_other_workers=False,
                pure=False,
                retries=0,
            )
            self._running[address] = (work, future)
            future.add_done_callback(lambda done, address=address: self._finished.put((address, done)))

    def _workers(self) -> set[str]:
        """Addresses of those that are there. Raises InputError where the scheduler has gone."""
        client = self._pool.client
        try:
            if client.status == "running":
                return set(client.nthreads())
        except (OSError, TimeoutError, RuntimeError, ValueError):
            pass  # it went while it was asked
        raise InputError(
            "the Dask scheduler has gone; what is done stays done: start it and its workers again, then "
            f"'gridlight farm run {self._job.folder}' goes on from here"
        )

    def _choose(self, address: str, alive: set[str]) -> Work | None:
        """Earlier volumes first, of them what the worker has on the GPU; what another one has only where that is gone
        or has more waiting than it can begin."""
        for group in sorted({work.group for work in self._waiting}):
            works = [work for work in self._waiting if work.group == group]
            owners = {work: self._owner.get(_blocks(work)) for work in works}
            own = [work for work in works if owners[work] == address]
            if own:
                return own[-1]  # the youngest surfaces are the last to be given up
            free = [work for work in works if owners[work] not in alive]
            if free:
                return free[0]
            for work in works:
                if sum(owner == owners[work] for owner in owners.values()) > 1:
                    return work
        return None

    def _say_whether_alone(self, alive: set[str]) -> None:
        if alive:
            self._alone_since = None
            return
        if self._refused and not self._workers() - self._refused:
            raise InputError(f"no worker can serve this job; the last one: {self._refusal}")
        now = time.monotonic()
        self._alone_since = self._alone_since or now
        if now - self._alone_since > _SAY_SECONDS:
            self._reporter.note("waiting for a worker; start some with 'gridlight farm worker ADDRESS'")
            self._alone_since = now + 1e9

    # Outcomes
    # ------------------------------------------------------------------------------------------------------------------

    def _collect(self) -> None:
        try:
            address, future = self._finished.get(timeout=_POLL_SECONDS)
        except queue.Empty:
            return
        if self._running.get(address, (None, None))[1] is not future:
            return  # given up before
        self._workers()  # a scheduler that goes takes all futures with it: nobody failed
        work, _ = self._running.pop(address)
        error = None if future.status == "finished" else (future.exception() or "it was cancelled")
        if isinstance(error, WorkerRefused):
            self._refused.add(address)
            self._refusal = str(error)
            self._reporter.note(f"worker {address} is left out: {error}")
            self._waiting.insert(0, work)
        elif error is not None:
            self._failed(work, address, _in_a_line(error))
        else:
            self._done(work, address)

    def _done(self, work: Work, address: str) -> None:
        self._reporter.advance()
        if work.shard is not None:
            self._owner[_blocks(work)] = address
            if self._job.output(work.iteration, work.shard) is None:
                self._failed(work, address, "its output is not there, or was damaged")
                return
        group = work.group
        if work.shard is None or (work.iteration == 0 and not self._has_votes_to_come(group)):
            self._advance(group)

    def _has_votes_to_come(self, group) -> bool:
        everything = [*self._waiting, *(work for work, _ in self._running.values())]
        return any(work.group == group and work.iteration == 0 for work in everything)

    def _failed(self, work: Work, address: str, reason: str) -> None:
        tries = self._tries[work] = self._tries.get(work, 0) + 1
        what = self._job.describe(work.shard) if work.shard else f"the votes of volume {work.group}"
        number = work.shard.number if work.shard else None
        self._job.event(
            "failed", iteration=work.iteration, shard=number, attempt=tries, worker=address, reason=reason[:300]
        )
        self._reporter.note(f"{what}, iteration {work.iteration}: try {tries} of {TRIES} failed: {reason}")
        if tries < TRIES:
            self._waiting.append(work)
            return
        if work.shard is None:
            raise InputError(f"{what} cannot be merged: {reason}")
        self._job.event("poison", iteration=work.iteration, shard=number, reason=reason[:300])
        self._reporter.warn(f"{what} failed {TRIES} times and is given up; its probes will be marked invalid: {reason}")
        self._poison.add(work.shard.number)
        if work.iteration == 0 and not self._has_votes_to_come(work.group):
            self._advance(work.group)


def _task() -> Callable[[str, dict, float], dict]:
    """What workers execute. As a function within a function it travels by value: schedulers unpack what they pass on,
    and know nothing of Gridlight."""

    def execute(job, request, seconds):
        from gridlight.farm import tasks

        return tasks.execute(job, request, seconds)

    return execute


_execute = _task()


def _blocks(work: Work) -> tuple | None:
    return (work.group[1], work.shard.blocks) if work.shard else None


def _in_a_line(error) -> str:
    text = " ".join(str(error).split())
    name = type(error).__name__
    return "its worker was lost" if name == "KilledWorker" else text or name
