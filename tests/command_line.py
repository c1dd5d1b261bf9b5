# SPDX-License-Identifier: GPL-3.0-or-later
"""What must hold of a finished ``gridlight`` process, and one whose disk is full."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

START = Path(__file__).resolve().parents[1] / "cli" / "__main__.py"
_FULL_DISK = """
import resource, runpy, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
size, start = int(sys.argv[1]), sys.argv[2]
resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
sys.argv = ["gridlight", *sys.argv[3:]]
runpy.run_path(start, run_name="__main__")
"""


def last_json(done: subprocess.CompletedProcess) -> dict:
    """The summary, which is the last line of standard output."""
    return json.loads(done.stdout.splitlines()[-1])


def assert_one_line(done: subprocess.CompletedProcess, status: int, *words: str) -> None:
    """The command ended with ``status`` and said exactly one line, which holds ``words``."""
    lines = done.stderr.splitlines()
    assert done.returncode == status, (done.returncode, done.stdout, done.stderr)
    assert len(lines) == 1 and not done.stdout, (done.stdout, done.stderr)
    assert lines[0].startswith("gridlight: "), lines
    for word in words:
        assert word in lines[0]


def run_on_a_full_disk(room_bytes: int, *arguments) -> subprocess.CompletedProcess:
    """``gridlight`` with ``arguments``. A limit on the size of each file stands for the disk: writing beyond it fails
    the same way."""
    words = [str(room_bytes), str(START), *map(str, arguments)]
    command = [sys.executable, "-I", "-c", _FULL_DISK, *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
