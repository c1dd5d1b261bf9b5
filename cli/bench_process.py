# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs one measurement of ``bench`` in a process of its own, so that a peer that crashes or hangs ends only itself.

The process is a child as ``cli.worker`` describes it, with two differences: its standard output comes back to us, one
JSON object a line as soon as each is known, and it has a time limit.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from . import worker

# Whatever an earlier run left in the drivers' shader caches would make a first run look warm.
_NO_SHADER_CACHES = {"MESA_SHADER_CACHE_DISABLE": "true", "__GL_SHADER_DISK_CACHE": "0"}


def _caches(folder: str | None) -> dict[str, str]:
    """What tells drivers to cache shaders in ``folder`` alone, or nowhere."""
    if folder is None:
        return _NO_SHADER_CACHES
    return {"MESA_SHADER_CACHE_DIR": folder, "__GL_SHADER_DISK_CACHE_PATH": folder, "__GL_SHADER_DISK_CACHE": "1"}


def measure_in_child(
    request: dict, limit_s: float, options: list[str], in_blender: bool, verbose: bool
) -> tuple[list[dict], str]:
    """Measures ``request`` (see ``bench_measure.measure``). Drivers cache shaders in its "shader_cache", a folder, or
    not at all.

    Returns (what the process reported, why it ended early). The reason is empty where it did not; what was reported
    before counts all the same.
    """
    status_read, status_write = os.pipe()
    alive_read, alive_write = os.pipe()
    with tempfile.TemporaryFile() as log:
        descriptors = (status_write, log.fileno(), alive_read)
        child = subprocess.Popen(
            [*_program(in_blender), "bench", "peers", "--measure", json.dumps(request), *options],
            env={
                **os.environ,
                **_caches(request.get("shader_cache")),
                worker.DESCRIPTORS: ",".join(map(str, descriptors)),
            },
            pass_fds=descriptors,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            process_group=0,
        )
        try:
            os.close(status_write)
            os.close(alive_read)
            late = False
            try:
                output, _ = child.communicate(timeout=limit_s)
            except subprocess.TimeoutExpired:
                late = True
                child.kill()
                output, _ = child.communicate()
        finally:  # also when the user interrupts the wait
            if child.poll() is None:
                child.kill()
                child.wait()
            os.close(alive_write)
            os.close(status_read)
        log.seek(0)
        chatter = log.read().decode("utf-8", "replace").strip()
    if verbose and chatter:
        print(chatter, file=sys.stderr)
    reports = [json.loads(line) for line in output.decode("utf-8").splitlines() if line.endswith("}")]
    return reports, _why_early(reports, child.returncode, late, limit_s)


def _program(in_blender: bool) -> list[str]:
    if in_blender:
        import bpy

        if bpy.app.binary_path:  # empty where Blender is a Python module
            return [bpy.app.binary_path, "--command", "gridlight"]
    return [sys.executable, "-I", str(Path(__file__).with_name("__main__.py"))]


def _why_early(reports: list[dict], code: int, late: bool, limit_s: float) -> str:
    if late:
        return f"not done after {limit_s:.4g} s (--limit or --budget)"
    if code < 0:
        return f"its process ended with {signal.Signals(-code).name} (--verbose shows Blender's words)"
    problems = [report["problem"] for report in reports if "problem" in report]
    if problems:
        return problems[-1]
    if not (reports and "status" in reports[-1]):
        return f"its process ended with status {code}; the lines above say why"
    return ""
