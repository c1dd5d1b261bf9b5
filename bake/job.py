# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake from a scene snapshot to a field, driven to its end.

Bakes are generators that yield between pieces of GPU work; a timer can drive them step by step as well. Cancelling is
not calling ``next`` again. What is to be relit later keeps its session of ``block_session.open_session`` instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..core.errors import Cancelled
from .bake_job import BakeJob
from .block_session import open_session
from .result import BakeResult, Reporter


def run_bake(job: BakeJob, reporter: Reporter, should_stop: Callable[[], bool]) -> BakeResult:
    """Bakes to the end. Needs a GPU context.

    Raises:
        InputError: the scene has no surface, or the grid does not fit the GPU.
        Cancelled: ``should_stop`` returned true between two steps.
    """
    result = BakeResult()
    drive(open_session(job, reporter, result).bake(), should_stop)
    return result


def drive(steps: Iterator[None], should_stop: Callable[[], bool]) -> None:
    """Follows ``steps`` to their end.

    Raises:
        Cancelled: ``should_stop`` returned true between two of them.
    """
    for _ in steps:
        if should_stop():
            raise Cancelled("cancelled; nothing was written")
