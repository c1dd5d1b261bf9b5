# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings and volumes of a plan as the bake knows them. Needs no Blender."""

from __future__ import annotations

import numpy as np

from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from . import container
from .job import Job


def settings_of(plan: dict) -> BakeSettings:
    """The settings that ``BakeSettings.as_dict`` wrote into ``plan``."""
    values = dict(plan["settings"])
    values["bounces"] = None if values["bounces"] == "auto" else values["bounces"]
    return BakeSettings(**values)


def volume_of(job: Job, group: tuple[int, int]) -> tuple[Grid, np.ndarray, ProbeEdits]:
    """Grid, states before capture and edits of a volume at a frame. Raises container.Damaged."""
    volume = job.plan["frames"][group[0]]["volumes"][group[1]]
    path = job.objects / volume["layout"]
    container.check(path)
    _, arrays = container.arrays(path)
    grid = Grid(np.array(volume["matrix"], float), tuple(volume["resolution"]), volume["name"])
    return grid, arrays["state"], ProbeEdits(arrays["disabled"].astype(bool), arrays["offset"])
