# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake that is interrupted, or whose parent goes, ends soon and leaves nothing."""

import os
import signal
import subprocess
import sys
import time

import pytest
from bake_command import lamp, room, save


@pytest.fixture(scope="module")
def long_bake(tmp_path_factory):
    """Command line of a bake that takes minutes, without its output folder."""
    blend = save(tmp_path_factory.mktemp("scenes") / "long.blend", room, lamp)
    return [
        "bake",
        blend,
        "--min",
        "-1,-1,-1",
        "--max",
        "1,1,1",
        "--resolution",
        "40,40,40",
        "--keep-all",
        "--face",
        "32",
        "--tolerance",
        "1e-6",
        "--memory",
        "64",
    ]


@pytest.mark.parametrize("delay", [*(pytest.param(d, marks=pytest.mark.any_version) for d in (0.25, 0.6, 4.0)), 1.5])
@pytest.mark.parametrize("whole_group", [False, True], ids=["parent", "group"])
def test_one_interrupt_ends_it_cleanly(long_bake, root, tmp_path, delay, whole_group):
    """As a terminal delivers Ctrl-C (to the whole process group) and as ``kill -INT`` does (to the parent)."""
    process = subprocess.Popen(
        [sys.executable, "-I", root / "cli" / "__main__.py", *long_bake, "-o", tmp_path / "out"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    time.sleep(delay)
    (os.killpg if whole_group else os.kill)(process.pid, signal.SIGINT)
    started = time.monotonic()
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert time.monotonic() - started < 10
    assert "Traceback" not in errors and not output
    assert not list(tmp_path.iterdir())


def test_the_child_ends_when_the_parent_is_killed(long_bake, root, tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-I", root / "cli" / "__main__.py", *long_bake, "-o", tmp_path / "out"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    time.sleep(2)
    children = open(f"/proc/{process.pid}/task/{process.pid}/children").read().split()
    assert len(children) == 1
    process.kill()
    process.wait()
    for _ in range(100):
        if not os.path.exists(f"/proc/{children[0]}/exe"):
            break
        time.sleep(0.2)
    else:
        os.kill(int(children[0]), signal.SIGKILL)
        pytest.fail("the child went on without its parent")
