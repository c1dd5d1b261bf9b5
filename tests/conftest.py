# SPDX-License-Identifier: GPL-3.0-or-later
"""Loads the repository as the package ``gridlight`` and ends the test run safely with Blender in the process."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


def _load_package():
    spec = importlib.util.spec_from_file_location(
        "gridlight", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
    )
    package = importlib.util.module_from_spec(spec)
    sys.modules["gridlight"] = package
    spec.loader.exec_module(package)


_load_package()

# What is measured on this device once stays between test runs, but out of the user's own cache folder.
os.environ.setdefault("GRIDLIGHT_CACHE", str(ROOT / "tests" / ".pytest_cache" / "gridlight"))

_exit_status = 0


def pytest_sessionfinish(session, exitstatus):
    global _exit_status
    _exit_status = int(exitstatus)


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    # The bpy wheels can hang when the interpreter shuts down. The summary has been printed by now.
    if "bpy" in sys.modules:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(_exit_status)


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository's root folder."""
    return ROOT


@pytest.fixture(scope="session")
def run_gridlight():
    """Runs ``gridlight`` with arguments in this environment's Python; returns the completed process with text
    output."""

    def run(*arguments, **options):
        options = {"capture_output": True, "text": True, "timeout": 600, **options}
        command = [sys.executable, "-I", str(ROOT / "cli" / "__main__.py"), *map(str, arguments)]
        return subprocess.run(command, check=False, **options)

    return run


@pytest.fixture(scope="session")
def gpu_context():
    """A usable GPU context in this process. Without one the test fails: it is never skipped."""
    # Blender ends the whole process where it finds no driver, so another one tries first.
    program = (
        "import importlib.util, os, sys\n"
        f"spec = importlib.util.spec_from_file_location('start', {str(ROOT / 'cli' / '__main__.py')!r})\n"
        "start = importlib.util.module_from_spec(spec); spec.loader.exec_module(start); start.load_package()\n"
        "from gridlight.gpu_shaders.context import ensure_context\n"
        "ensure_context(); sys.stdout.flush(); os._exit(0)\n"
    )
    command = [sys.executable, "-I", "-c", program]
    attempt = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    if attempt.returncode != 0:
        pytest.fail(
            f"no GPU context: a Blender process that made one ended with {attempt.returncode}\n"
            f"{attempt.stdout}{attempt.stderr}"
        )
    from gridlight.gpu_shaders.context import ensure_context

    ensure_context()
