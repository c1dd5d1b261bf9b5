# SPDX-License-Identifier: GPL-3.0-or-later
"""Dispatches of one thread an element, as LINEAR_THREAD in data_lib.glsl counts them."""

from __future__ import annotations

import gpu

GROUP = 64  # threads
_COMPACTION_GROUP = 256  # threads, see compaction_lib.glsl
_GROUPS_IN_ROW = 2**21 // GROUP


def is_software() -> bool:
    """Whether shaders run on processor cores: as many threads as one works on have to be paid for there, while a GPU
    has thousands that wait for nothing but each other."""
    return gpu.platform.device_type_get() == "SOFTWARE"


def compaction_run() -> int:
    """Entries of a compaction that a thread takes one after the other."""
    return 16 if is_software() else 4


def compaction_groups(entries: int) -> int:
    """Groups that take so many entries of a compaction."""
    return -(-entries // (_COMPACTION_GROUP * compaction_run()))


def dispatch_linear(shader, threads: int) -> None:
    groups = -(-threads // GROUP)
    if groups:
        gpu.compute.dispatch(shader, min(groups, _GROUPS_IN_ROW), -(-groups // _GROUPS_IN_ROW), 1)
