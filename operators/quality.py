# SPDX-License-Identifier: GPL-3.0-or-later
"""Named bake settings, each with the error that was measured for it."""

from __future__ import annotations

from dataclasses import dataclass

from ..core.settings import BakeSettings


@dataclass(frozen=True)
class Quality:
    """A choice of settings and what it is good for.

    ``error_percent`` is the relative RMS of irradiance at the gallery's probes against Cycles, from
    docs/measurements/pareto-gallery-h200.txt. ``settings`` holds only what a preset decides; the rest stays the user's.
    """

    name: str
    purpose: str
    error_percent: float
    settings: dict

    @property
    def description(self) -> str:
        return f"{self.purpose}. Measured in the gallery: {self.error_percent:.1f} % from path tracing"


def _decided(face: int, samples: int, gather: int) -> dict:
    """What a preset decides, in the names of the property group."""
    standard = BakeSettings()
    return {
        "face": face,
        "samples": samples,
        "gather": gather,
        "bounces_auto": standard.bounces is None,
        "tolerance": standard.tolerance,
    }


QUALITIES = {
    "DRAFT": Quality("Draft", "Quick look while things move", 3.1, _decided(8, 1, 0)),
    "GOOD": Quality("Good", "For most scenes", 2.4, _decided(BakeSettings.face, BakeSettings.samples, 0)),
    "FINAL": Quality("Final", "Finer faces, four times the rays; several times slower", 2.1, _decided(32, 4, 0)),
}
