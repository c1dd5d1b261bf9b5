# SPDX-License-Identifier: GPL-3.0-or-later
"""The launcher in a small checkout of its own: real environments, but with pin files that ask for nothing."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PYTHON = os.path.realpath(sys.executable)
VERSION = f"{sys.version_info[0]}.{sys.version_info[1]}"
SERIES = {"3.13": "5.2", "3.11": "4.5"}[VERSION]

pytestmark = [pytest.mark.any_version, pytest.mark.skipif(os.name != "posix", reason="the launcher is a shell script")]


@pytest.fixture
def checkout(tmp_path):
    """A folder (with a blank in its name) with the launcher, empty pins and a command line that prints what it gets."""
    folder = tmp_path / "a checkout"
    (folder / "cli").mkdir(parents=True)
    (folder / "requirements").mkdir()
    shutil.copy(ROOT / "gridlight", folder)
    shutil.copy(ROOT / "cli" / "system_libraries.py", folder / "cli")
    (folder / "cli" / "__main__.py").write_text("import sys\nprint(sys.prefix, *sys.argv[1:])\nsys.exit(7)\n")
    for name in ("bpy52.txt", "bpy45.txt", "test.txt", "farm.txt"):
        (folder / "requirements" / name).write_text("# nothing\n")
    return folder


def launch(checkout, *arguments, command=None, **environment):
    variables = {**os.environ, "GRIDLIGHT_PYTHON": PYTHON, **environment}
    variables = {name: value for name, value in variables.items() if value is not None}
    return subprocess.run(
        [command or checkout / "gridlight", *arguments],
        env=variables,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        stdin=subprocess.DEVNULL,
    )


def test_first_call_makes_the_environment_and_the_next_uses_it(checkout, tmp_path):
    first = launch(checkout, "info", "a b")
    assert (first.returncode, first.stdout) == (7, f"{checkout / '.venv'} info a b\n"), first.stderr
    assert "making" in first.stderr and SERIES in first.stderr
    second = launch(checkout, "info")
    assert (second.returncode, second.stderr) == (7, "")
    # Through two symbolic links, one of them relative, from another folder, without a Python to be found.
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "gl").symlink_to("../link")
    (tmp_path / "link").symlink_to(checkout / "gridlight")
    third = launch(checkout, "x", command=tmp_path / "bin" / "gl", GRIDLIGHT_PYTHON=None, PATH="/usr/bin:/bin")
    assert (third.returncode, third.stdout, third.stderr) == (7, f"{checkout / '.venv'} x\n", "")


def test_the_farm_has_an_environment_of_its_own_for_dask(checkout):
    """``farm run`` and ``worker`` run there and know Blender's Python; the other farm commands need no Dask."""
    (checkout / "farm").mkdir()
    program = "import os, sys\nprint(sys.prefix, os.environ.get('GRIDLIGHT_BLENDER_PYTHON'), *sys.argv[1:])\n"
    (checkout / "farm" / "__main__.py").write_text(program)
    blender, dask = checkout / ".venv", checkout / ".venv-farm"
    plan = launch(checkout, "farm", "plan", "a b", GRIDLIGHT_BLENDER_PYTHON=None)
    assert plan.stdout == f"{blender} None plan a b\n" and not dask.exists(), plan.stderr
    run = launch(checkout, "farm", "run", "JOB", GRIDLIGHT_BLENDER_PYTHON=None)
    assert run.stdout == f"{dask} {blender / 'bin' / 'python'} run JOB\n" and "Dask" in run.stderr, run.stderr
    assert launch(checkout, "farm", "worker", "x", GRIDLIGHT_BLENDER_PYTHON="y").stdout == f"{dask} y worker x\n"


def test_an_interrupted_installation_is_made_again(checkout):
    (checkout / ".venv" / "bin").mkdir(parents=True)
    (checkout / ".venv" / "bin" / "python").symlink_to(PYTHON)
    done = launch(checkout, "x")
    assert done.returncode == 7 and "removing the unfinished" in done.stderr
    assert (checkout / ".venv" / "gridlight-complete").exists()


def test_new_pins_update_the_environment(checkout):
    launch(checkout)
    pins = checkout / "requirements" / ("bpy52.txt" if SERIES == "5.2" else "bpy45.txt")
    pins.write_text("# another comment changes nothing\n")
    assert launch(checkout).stderr == ""
    pins.write_text("pip\n")
    assert "new pins" in launch(checkout).stderr
    assert launch(checkout).stderr == ""


def test_a_failed_installation_is_not_believed(checkout):
    for pins in (checkout / "requirements").glob("bpy*.txt"):
        pins.write_text("./does-not-exist\n")
    for _ in range(2):
        done = launch(checkout)
        assert done.returncode == 2 and "failed" in done.stderr.splitlines()[-1]
    assert not (checkout / ".venv.lock").exists()


def test_a_stale_lock_does_not_block(checkout):
    (checkout / ".venv.lock").mkdir()
    ended = subprocess.Popen(["true"])
    ended.wait()
    (checkout / ".venv.lock" / "pid").write_text(str(ended.pid))
    assert launch(checkout).returncode == 7


def test_two_first_calls_at_once(checkout):
    variables = {**os.environ, "GRIDLIGHT_PYTHON": PYTHON}
    both = [
        subprocess.Popen(
            [checkout / "gridlight"], env=variables, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
        )
        for _ in range(2)
    ]
    errors = [process.communicate(timeout=120)[1] for process in both]
    assert [process.returncode for process in both] == [7, 7]
    assert sum("making" in text for text in errors) == 1 and sum("waiting" in text for text in errors) == 1


@pytest.mark.parametrize("python", ["/nonexistent/python", "/bin/false", "wrong-version"])
def test_a_python_that_does_not_fit(checkout, tmp_path, python):
    if python == "wrong-version":
        python = tmp_path / "python"
        python.write_text("#!/bin/sh\necho 3.9\n")
        python.chmod(0o755)
    done = launch(checkout, GRIDLIGHT_PYTHON=str(python))
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1
    assert "GRIDLIGHT_PYTHON" in done.stderr and "3.13 or 3.11" in done.stderr
    assert not (checkout / ".venv").exists()


def test_a_shim_that_fails_is_passed_over(checkout, tmp_path):
    """pyenv puts commands on PATH that end with 127 where their version is not switched on."""
    shims, real = tmp_path / "shims", tmp_path / "real"
    for folder in (shims, real):
        folder.mkdir()
    for version in ("3.13", "3.11"):
        (shims / f"python{version}").write_text("#!/bin/sh\necho 'command not found' >&2\nexit 127\n")
        (shims / f"python{version}").chmod(0o755)
    home = tmp_path / "home"
    (home / ".pyenv" / "versions" / f"{VERSION}.99" / "bin").mkdir(parents=True)
    (home / ".pyenv" / "versions" / f"{VERSION}.99" / "bin" / "python").symlink_to(PYTHON)
    done = launch(
        checkout,
        "--environment",
        SERIES,
        GRIDLIGHT_PYTHON=None,
        PATH=f"{shims}:/usr/bin:/bin",
        HOME=str(home),
        PYENV_ROOT=None,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{checkout / '.venv' / 'bin' / 'python'}\n"


def test_no_python_at_all(checkout, tmp_path):
    (tmp_path / "bin").mkdir()
    for tool in ("sh", "dirname", "readlink", "cut", "grep", "cksum", "tr", "cat"):
        (tmp_path / "bin" / tool).symlink_to(shutil.which(tool))
    done = launch(checkout, GRIDLIGHT_PYTHON=None, PATH=str(tmp_path / "bin"), HOME=str(tmp_path), PYENV_ROOT=None)
    if Path("/usr/local/bin/python3.13").exists() or Path("/usr/local/bin/python3.11").exists():
        pytest.skip("a Python stands where the launcher looks whatever PATH says")
    assert done.returncode == 2 and "no Python 3.13 or 3.11" in done.stderr and len(done.stderr.splitlines()) == 1


def test_ctrl_c_during_the_installation_leaves_no_lock(checkout):
    for pins in (checkout / "requirements").glob("bpy*.txt"):
        pins.write_text("pip\n")
    process = subprocess.Popen(
        [checkout / "gridlight"],
        env={**os.environ, "GRIDLIGHT_PYTHON": PYTHON},
        text=True,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    )
    for _ in range(100):
        if (checkout / ".venv").exists():
            break
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130
    assert not (checkout / ".venv.lock").exists() and not (checkout / ".venv" / "gridlight-complete").exists()
    assert launch(checkout).returncode == 7
