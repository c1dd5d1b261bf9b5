# SPDX-License-Identifier: GPL-3.0-or-later
"""The Blender process of a worker: started when it is needed, asked, and ended when it is too slow. Standard library
only."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import IO

BLENDER_PYTHON = "GRIDLIGHT_BLENDER_PYTHON"  # the environment's variable that names the Python with Blender in it
_START_SECONDS = 300.0  # for Blender, the GPU's context and its first answer
_LOG_TAIL = 400  # characters of its last words that are worth showing


class ShardFailed(Exception):
    """A request was not answered, or with an error; the message says why in one line."""


class WorkerRefused(Exception):
    """This machine cannot serve the job at all: another kind of device, no job folder."""


class BlenderProcess:
    """Serves the requests of one job; ``ask`` starts the process where none runs."""

    def __init__(self, job: str):
        self._job = job
        self._process: subprocess.Popen | None = None
        self._log: IO[bytes] | None = None
        self._pending = b""  # of an answer that is not whole yet

    @property
    def pid(self) -> int | None:
        return self._process.pid if self._process else None

    def ask(self, request: dict, seconds: float) -> dict:
        """The answer to ``request``. The process stays, unless it is too slow or broken.

        Raises:
            ShardFailed: an error, an end of the process, or no answer within ``seconds``.
            WorkerRefused: the process cannot do anything for this job.
        """
        if self._process is None or self._process.poll() is not None:
            self._start()
        try:
            self._process.stdin.write(json.dumps(request).encode() + b"\n")
            self._process.stdin.flush()
        except OSError:
            pass  # it has ended: no answer comes, and that is told
        answer = self._answer(seconds, f"took longer than {seconds:g} s and was ended")
        if "error" in answer:
            if answer.get("broken"):
                self.end()
            raise ShardFailed(answer["error"])
        return answer

    def end(self) -> None:
        """Ends the process at once."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process.stdin.close()
            self._process.stdout.close()
            self._process = None

    def _start(self) -> None:
        self.end()
        self._log = tempfile.TemporaryFile()
        python = os.environ.get(BLENDER_PYTHON, sys.executable)
        start = Path(__file__).with_name("__main__.py")
        self._process = subprocess.Popen(
            [python, "-I", str(start), "serve", self._job],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            process_group=0,
        )
        self._pending = b""
        answer = self._answer(_START_SECONDS, "did not start")
        if "error" in answer:
            self.end()
            raise WorkerRefused(answer["error"])

    def _answer(self, seconds: float, too_slow: str) -> dict:
        deadline = time.monotonic() + seconds
        output = self._process.stdout.fileno()
        while b"\n" not in self._pending:
            ready, _, _ = select.select([output], [], [], max(deadline - time.monotonic(), 0.0))
            if not ready:
                self.end()
                raise ShardFailed(f"its Blender process {too_slow}")
            data = os.read(output, 1 << 16)
            if not data:
                code = self._process.wait()
                last_words = self._last_words()
                self.end()
                how = signal.Signals(-code).name if code < 0 else f"status {code}"
                raise ShardFailed(f"its Blender process ended with {how}{last_words}")
            self._pending += data
        line, _, self._pending = self._pending.partition(b"\n")
        return json.loads(line)

    def _last_words(self) -> str:
        size = self._log.seek(0, os.SEEK_END)
        self._log.seek(max(size - _LOG_TAIL, 0))
        lines = self._log.read().decode("utf-8", "replace").strip().splitlines()
        return f"; its last words: {lines[-1]}" if lines else ""
