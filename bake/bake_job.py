# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake is asked for, whoever carries it out."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot


@dataclass(frozen=True)
class BakeJob:
    """The light of ``snapshot`` in ``grid``."""

    snapshot: SceneSnapshot
    grid: Grid
    settings: BakeSettings
    edits: ProbeEdits | None = None  # probes that the user switched off, or moved: these capture there and stay there

    @property
    def probe_edits(self) -> ProbeEdits:
        """``edits``, none where there are none."""
        return self.edits or ProbeEdits.none(self.grid)
