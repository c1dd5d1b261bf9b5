# SPDX-License-Identifier: GPL-3.0-or-later
"""The real Blender with a window, on each GPU backend. Where it cannot be had, the tests fail: they are never
skipped."""

import sys
import tempfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from session import ROOT, BlenderSession, build_extension, full_blender


@pytest.fixture(scope="session")
def full_blender_command() -> list[str]:
    return full_blender()


@pytest.fixture(scope="session")
def extension_zip(full_blender_command):
    """The extension as users install it."""
    with tempfile.TemporaryDirectory(prefix="gridlight-zip-") as folder:
        yield build_extension(full_blender_command, Path(folder))


@pytest.fixture(scope="session")
def blender(request, full_blender_command, extension_zip):
    """A Blender on the backend that the test names; pictures go to out/gui/<backend>."""
    backend = request.param
    session = BlenderSession(full_blender_command, backend, extension_zip, ROOT / "out" / "gui" / backend)
    yield session
    session.stop()
