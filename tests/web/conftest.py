# SPDX-License-Identifier: GPL-3.0-or-later
"""A browser, the packages of package.json and a server for the tests that run exports in the real three.js.

Chromium and npm are needed. Where one is missing the tests fail and say what installs it; they are never skipped.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from gridlight.cli import headless_browser
from gridlight.core.errors import InputError

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "export")]


def _here(find, *arguments):
    """``find(*arguments)``; what is missing fails the test and is named."""
    try:
        return find(*arguments)
    except InputError as missing:
        pytest.fail(str(missing))


@pytest.fixture(scope="session")
def packages() -> Path:
    """The folder node_modules with what package-lock.json pins."""
    return _here(headless_browser.install_packages, HERE)


@pytest.fixture(scope="session")
def node():
    """Runs JavaScript in Node with the packages at hand; returns what it prints, as JSON."""
    program = _here(headless_browser.tool, ("node", "nodejs"), "nodejs")

    def run(script: Path, *arguments):
        command = [program, script, *map(str, arguments)]
        done = subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 0, done.stderr[-3000:]
        return json.loads(done.stdout)

    return run


@pytest.fixture(scope="session")
def browse(packages):
    """Opens a page of a folder in headless Chromium.

    Called with the folder, the page and extra files by name, it returns what the page posts to /result; with
    ``screenshot``, a path, it saves a picture of the page instead.
    """
    _here(headless_browser.tool, headless_browser.CHROMIUM, "chromium")

    def open_page(folder, page, extra=None, screenshot=None):
        return headless_browser.open_page(folder, page, packages, extra, screenshot=screenshot)

    return open_page
