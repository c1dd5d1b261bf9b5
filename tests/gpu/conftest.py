# SPDX-License-Identifier: GPL-3.0-or-later
"""Every test here runs on a real GPU context and fails without one; helpers beside the tests can be imported."""

import sys
from pathlib import Path

import bpy  # noqa: F401  puts gpu and gpu_extras within reach
import pytest

sys.path.insert(0, str(Path(__file__).parent))


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.gpu)


@pytest.fixture(autouse=True)
def _context(gpu_context):
    """Makes ``gpu_context`` part of every test."""
