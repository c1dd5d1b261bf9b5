# SPDX-License-Identifier: GPL-3.0-or-later
"""Which probes capture at all."""

from __future__ import annotations

import numpy as np

from ..core import culling
from ..core.conventions import ACTIVE, CULLED
from ..core.errors import InputError
from ..core.grid import Grid
from ..core.kept import Kept
from ..core.open_air import OPEN, open_nodes
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot

_kept_needed = Kept(lambda grid, vertices, triangles: culling.needed_nodes(grid, vertices[triangles]))


def cull(snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings, edits: ProbeEdits) -> np.ndarray:
    """(P,) uint8 states before capture: ACTIVE, CULLED, or OPEN for those culled that capture all the same.

    Raises:
        InputError: the user switched off every probe.
    """
    state = np.full(grid.count, ACTIVE, np.uint8)
    if not settings.keep_all:
        state[~_kept_needed(grid, snapshot.vertices, snapshot.triangles)] = CULLED
    state[edits.disabled] = CULLED
    if edits.disabled.any() and not (state == ACTIVE).any():
        raise InputError(f"{grid.name}: every probe is switched off; bring some back with Reset in the Volume panel")
    state[open_nodes(grid, state, edits.disabled)] = OPEN
    return state
