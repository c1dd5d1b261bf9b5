# SPDX-License-Identifier: GPL-3.0-or-later
"""What Dask's workers execute. Each worker has one Blender process, which keeps scene and surfaces between tasks."""

from __future__ import annotations

import atexit

from .blender_process import BlenderProcess

_process: BlenderProcess | None = None
_job = ""


def execute(job: str, request: dict, seconds: float) -> dict:
    """Has this worker's Blender process answer ``request`` for the job in the folder ``job``, see farm/serve.py.

    Raises:
        ShardFailed: it did not, within ``seconds``.
    """
    global _process, _job
    if _process is None or _job != job:
        end()
        _process, _job = BlenderProcess(job), job
    return _process.ask(request, seconds)


def end() -> None:
    """Ends this worker's Blender process."""
    global _process
    if _process is not None:
        _process.end()
        _process = None


atexit.register(end)
