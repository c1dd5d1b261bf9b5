# SPDX-License-Identifier: GPL-3.0-or-later
"""What the files of several volumes are called."""

from __future__ import annotations

import re


def volume_endings(names: list[str]) -> list[str]:
    """What tells the files of volumes called ``names`` apart, ``_<name>`` each: safe on every file system and unique.

    Nothing for a single volume, whose files are ``probes.exr`` and so on.
    """
    if len(names) == 1:
        return [""]
    endings = []
    taken = set()
    for name in names:
        stem = re.sub(r"[^\w.-]+", "_", name).strip("._")[:64] or "volume"
        ending, number = stem, 1
        while ending.casefold() in taken:  # some file systems do not tell upper from lower case
            number += 1
            ending = f"{stem}_{number}"
        taken.add(ending.casefold())
        endings.append(f"_{ending}")
    return endings
