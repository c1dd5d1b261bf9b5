# SPDX-License-Identifier: GPL-3.0-or-later
"""What the times of a benchmark depend on besides the GPU, and how it was called."""

from __future__ import annotations

import os
import platform
import shlex
import sys
from pathlib import Path

_LOADED = 0.3  # of the cores busy before the bench began: times are then no longer those of an idle machine


def describe() -> dict:
    """Processor, cores, system; the load tells whether others were at work when the bench began."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "processor": _processor(),
        "cores": cores,
        "load_before": load,
        "system": f"{platform.system()} {platform.machine()}",
    }


def head(summary: dict) -> list[str]:
    """The first lines of every table: command, versions, devices, load."""
    machine = summary["machine"]
    lines = [
        f"command   {summary['command']}",
        f"versions  Gridlight {summary['version']}, Blender {summary['blender']}",
        f"GPU       {summary['device']}",
        f"CPU       {machine['cores']} × {machine['processor']}, {machine['system']} (Cycles runs here)",
    ]
    load = machine["load_before"]
    if load is not None and load > _LOADED * machine["cores"]:
        lines.append(f"load      {load:.1f} before the bench began: the times are not those of an idle machine")
    return lines


def command() -> str:
    """The command line that was given, without what starts it."""
    words = sys.argv[sys.argv.index("bench") :] if "bench" in sys.argv else ["bench"]
    return f"./gridlight {shlex.join(words)}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:  # not Linux
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
