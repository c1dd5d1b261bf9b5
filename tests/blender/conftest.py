# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets the tests here import the scene builders beside them."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
