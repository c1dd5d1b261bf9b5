# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake from a scene snapshot to a field.

``bake_steps`` is the whole job as a generator that yields between pieces of GPU work: ``run_bake`` drives it to the
end, a timer can drive it step by step. Cancelling is not calling ``next`` again. What is to be relit later keeps its
session of ``block_session.open_session`` instead.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ..core.errors import Cancelled
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from .block_session import open_session
from .result import BakeResult, Reporter


def run_bake(
    snapshot: SceneSnapshot,
    grid: Grid,
    settings: BakeSettings,
    reporter: Reporter,
    should_stop: Callable[[], bool],
    edits: ProbeEdits | None = None,
) -> BakeResult:
    """Bakes ``snapshot`` into ``grid``, as ``bake_steps`` says. Needs a GPU context.

    Raises:
        InputError: the scene has no surface, or the grid does not fit the GPU.
        Cancelled: ``should_stop`` returned true between two steps.
    """
    result = BakeResult()
    drive(bake_steps(snapshot, grid, settings, reporter, result, edits), should_stop)
    return result


def bake_steps(
    snapshot: SceneSnapshot,
    grid: Grid,
    settings: BakeSettings,
    reporter: Reporter,
    result: BakeResult,
    edits: ProbeEdits | None = None,
) -> Iterator[None]:
    """The bake in steps; fills ``result`` as it goes and completes it with the last step.

    ``edits``: probes that the user switched off or moved. Moved ones capture where they were put and are not relocated.
    """
    yield from open_session(snapshot, grid, settings, reporter, edits, result).bake()


def drive(steps: Iterator[None], should_stop: Callable[[], bool]) -> None:
    """Follows ``steps`` to their end.

    Raises:
        Cancelled: ``should_stop`` returned true between two of them.
    """
    for _ in steps:
        if should_stop():
            raise Cancelled("cancelled; nothing was written")
