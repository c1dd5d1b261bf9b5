# SPDX-License-Identifier: GPL-3.0-or-later
"""``bake --relight``: other states of the scene, lit with what the bake before them left on the GPU."""

from __future__ import annotations

from dataclasses import asdict

import bpy

from ..bake.block_session import AnySession
from ..bake.job import drive
from ..bake.result import report_on
from ..core.snapshot import SceneSnapshot
from ..formats import probe_file, probe_metadata
from ..formats.file_names import volume_endings
from ..formats.staging import StagedFolder
from ..gpu_shaders.context import device_description
from ..scene.open_file import open_blend, set_frame
from ..scene.read import read_scene
from . import pipeline
from .bake import is_frame
from .run_clock import RunClock


def read_state(state: str, args) -> SceneSnapshot:
    """The scene in the file called ``state``, or at that frame of the file that was baked."""
    if is_frame(state):
        scene = bpy.context.scene if args.file is None else open_blend(args.file)
        return read_scene(scene, frame=int(state))
    scene = open_blend(state)
    if args.frame is not None:
        set_frame(scene, args.frame)
    return read_scene(scene)


def relight_all(
    args,
    sessions: list[AnySession],
    folder: StagedFolder,
    reporter,
    should_stop,
    stopwatch: RunClock,
) -> tuple[list[dict], bool]:
    """Relights ``sessions`` for each of ``args.relight`` in order and stages their probe files.

    Returns one entry a state and volume for the summary, and whether all light settled that should have.
    """
    entries, settled = [], True
    endings = volume_endings([session.grid.name for session in sessions])
    for number, state in enumerate(args.relight, 1):
        with stopwatch("read"):
            reporter.phase("read")
            snapshot = read_state(state, args)
        pipeline.check_snapshot(snapshot, reporter)
        for ending, session in zip(endings, sessions):
            drive(session.relight(snapshot), should_stop)
            result = session.result
            stopwatch.add(result.seconds)
            settled &= report_on(result, session.grid, session.settings, reporter)
            with stopwatch("write"):
                result.field.metadata = probe_metadata.provenance(
                    snapshot,
                    session.settings,
                    device_description(),
                    result.iterations,
                    result.converged,
                    reporter.warnings,
                )
                name = f"probes{ending}_relit{number}.exr"
                probe_file.write(folder.path(name), result.field)
            entries.append(
                {
                    "state": state,
                    "volume": session.grid.name,
                    "file": str(folder.folder / name),
                    "seconds": {phase: round(seconds, 6) for phase, seconds in result.seconds.items()},
                    "converged": result.converged,
                    **asdict(result.relit),
                }
            )
    return entries, settled
