# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers that stand beside the unit tests can be imported by them."""

import sys
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent)]
