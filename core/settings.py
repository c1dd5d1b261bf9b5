# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake settings: frozen, validated, made in exactly one place per front end."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from .errors import InputError

MAX_RESOLUTION = 256
FACE_SIZES = range(4, 129)
CAPTURES = ("auto", "raster", "trace")


@dataclass(frozen=True)
class BakeSettings:
    """What the user may choose about a bake. Lengths in metres, memory in mebibytes.

    Raises:
        InputError: a value is out of range; the message names the option and its range.
    """

    bands: int = 3
    face: int = 16
    bounces: int | None = None  # None: as many as the tolerance asks for ("auto")
    tolerance: float = 2e-3  # relative energy still missing when iterations stop
    gather: int = 0
    samples: int = 1  # times the rays and the samples of light of a patch (patches.effort)
    capture: str = "auto"
    seed: int = 0
    keep_all: bool = False
    memory_mib: int = 512
    block: int = 4096  # most probes of a block, see core/blocks.py
    deringing: bool = False  # window the probes whose irradiance falls below zero (core/ringing.py)

    def __post_init__(self):
        _check("--bands", self.bands, 1, 4)
        _check("--face", self.face, FACE_SIZES[0], FACE_SIZES[-1])
        if self.bounces is not None:
            _check("--bounces", self.bounces, 0, 10_000)
        _check("--tolerance", self.tolerance, 1e-6, 1.0)
        _check("--gather", self.gather, 0, 16)
        _check("--samples", self.samples, 1, 4096)
        _check("--seed", self.seed, 0, 2**31 - 1)
        _check("--memory", self.memory_mib, 16, 1 << 20)
        _check("--block", self.block, 1, MAX_RESOLUTION**3)
        if self.capture not in CAPTURES:
            raise InputError(f"--capture is '{self.capture}'; choose one of {', '.join(CAPTURES)}")

    def as_dict(self) -> dict:
        """Plain values for JSON; ``bounces`` None becomes "auto"."""
        values = asdict(self)
        values["bounces"] = "auto" if self.bounces is None else self.bounces
        return values


def _check(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:  # also false for NaN
        raise InputError(f"{name} is {value}; it must lie between {low} and {high}")
