# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispatches of one thread an element, as LINEAR_THREAD in data_lib.glsl counts them."""

from __future__ import annotations

import gpu

GROUP = 64  # threads
COMPACTION_BLOCK = 4096  # entries of a compaction that a group takes, see compaction_lib.glsl
_GROUPS_IN_ROW = 2**21 // GROUP


def dispatch_linear(shader, threads: int) -> None:
    groups = -(-threads // GROUP)
    if groups:
        gpu.compute.dispatch(shader, min(groups, _GROUPS_IN_ROW), -(-groups // _GROUPS_IN_ROW), 1)
