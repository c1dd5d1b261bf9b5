# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight farm serve``: a Blender process that makes shards as it is told, for ``farm worker``.

Reads a request a line from standard input and answers each with a line on standard output, JSON both; ends when the
input does. What Blender prints goes to standard error.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
import traceback

from ..core.errors import GridlightError
from . import container
from .job import Job

HELP = "makes shards as standard input says; what workers start"
NEEDS_GPU = True


def NEEDS_BLENDER(_args) -> bool:
    """It is the Blender process itself, started in the right environment, and must not start another one."""
    return False


def add_arguments(parser, in_blender: bool) -> None:
    parser.add_argument("job", metavar="JOB", help="folder of the job")


def run(args, reporter, should_stop):
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    sys.stdout.flush()
    os.dup2(2, 1)
    requests: queue.Queue = queue.Queue()
    threading.Thread(target=_listen, args=(requests,), daemon=True).start()

    def answer(document: dict) -> None:
        answers.write(json.dumps(document) + "\n")
        answers.flush()

    try:
        runner = _Runner(Job(args.job))
        answer({"ready": True})
        while True:
            answer(_guarded(runner, requests.get()))
    except GridlightError as error:
        answer({"error": str(error), "refused": True})
    sys.stderr.flush()
    os._exit(0)  # Blender's module can hang when the interpreter shuts down


class _Runner:
    """Answers requests: ``{"iteration": I, "shard": S}`` or ``{"votes": [frame, volume], "without": [S, …]}``."""

    def __init__(self, job: Job):
        import bpy  # noqa: F401  before gpu, which comes from it

        from ..gpu_shaders.context import ensure_context
        from .shards import ShardRunner

        ensure_context()
        self._job, self._shards = job, ShardRunner(job)

    def __call__(self, request: dict) -> dict:
        if "votes" in request:
            from .votes import merge_votes

            return {"verdict": merge_votes(self._job, tuple(request["votes"]), set(request["without"])).name}
        return self._shards.run(request["iteration"], request["shard"])


def _guarded(runner: _Runner, request: dict) -> dict:
    try:
        return runner(request)
    except (GridlightError, container.Damaged) as error:
        return {"error": str(error)}
    except Exception as error:  # a defect, or memory: the worker counts the failure and starts another process
        traceback.print_exc()
        return {"error": f"{type(error).__name__}: {error}", "broken": True}


def _listen(requests: queue.Queue) -> None:
    for line in sys.stdin:
        requests.put(json.loads(line))
    os._exit(0)  # whoever asked is gone: at once, also in the middle of a shard
