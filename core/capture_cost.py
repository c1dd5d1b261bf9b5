# SPDX-License-Identifier: GPL-3.0-or-later
"""What capturing costs by rasterising and by rays, predicted from a few timings of one device.

With P probes, T triangles and faces of F² texels::

    raster = r0 + P (r1 F² + r2 T)                  every triangle is drawn for every probe
    trace  = t0 + P F² (t1 + t2 log2 T)             a ray a texel, whose way through the hierarchy grows with its depth

Both take the same time at the crossover, a number of triangles. Timings are never twice the same, and the two captures
agree to tolerances only, so a choice at the very crossover would change bytes from run to run: it is rounded to a power
of two, and the timings are kept on disk (user_cache.py).
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

FEW, MANY = 12, 2048  # triangles of the trial scenes
MOST = 1 << 24  # triangles; more do not fit the GPU


@dataclass(frozen=True)
class Timings:
    """Seconds of trial captures, ``face``² texels a face: of one probe and of ``probes`` before FEW triangles, and of
    ``probes`` before MANY."""

    face: int
    probes: int
    raster_one: float
    raster_few: float
    raster_many: float
    trace_one: float
    trace_few: float
    trace_many: float

    def __post_init__(self):
        """Raises ValueError unless all are positive and finite."""
        if not all(isinstance(value, (int, float)) and 0 < value < 1e6 for value in asdict(self).values()):
            raise ValueError(f"not timings of captures: {self}")
        if self.probes < 2:
            raise ValueError("timings need two numbers of probes")


@dataclass(frozen=True)
class CaptureCost:
    """The model's five rates and two fixed costs, in seconds; see the module."""

    raster_fixed: float
    raster_texel: float
    raster_triangle: float
    trace_fixed: float
    trace_texel: float
    trace_level: float

    @classmethod
    def fitted(cls, timings: Timings) -> CaptureCost:
        """The model that gives ``timings``; rates that noise has made negative become zero."""
        probes, texels = timings.probes, timings.face**2
        raster_probe = max(timings.raster_few - timings.raster_one, 0.0) / (probes - 1)
        trace_probe = max(timings.trace_few - timings.trace_one, 0.0) / (probes - 1)
        raster_triangle = max(timings.raster_many - timings.raster_few, 0.0) / (probes * (MANY - FEW))
        level = max(timings.trace_many - timings.trace_few, 0.0) / (probes * texels * math.log2(MANY / FEW))
        return cls(
            raster_fixed=max(timings.raster_one - raster_probe, 0.0),
            raster_texel=max(raster_probe - FEW * raster_triangle, 0.0) / texels,
            raster_triangle=raster_triangle,
            trace_fixed=max(timings.trace_one - trace_probe, 0.0),
            trace_texel=max(trace_probe / texels - level * math.log2(FEW), 0.0),
            trace_level=level,
        )

    def raster(self, probes: int, triangles: float, face: int) -> float:
        """Seconds of capturing ``probes`` by rasterising."""
        return self.raster_fixed + probes * (self.raster_texel * face**2 + self.raster_triangle * triangles)

    def trace(self, probes: int, triangles: float, face: int) -> float:
        """Seconds of capturing ``probes`` by rays."""
        levels = math.log2(max(triangles, 2))
        return self.trace_fixed + probes * face**2 * (self.trace_texel + self.trace_level * levels)

    def crossover(self, probes: int, face: int) -> int:
        """Triangles up to which rasterising is cheaper: a power of two, 0 where it never is, MOST where always."""

        def rasterising_leads(exponent: int) -> bool:
            # Asked half-way between two powers, which rounds the crossover to the nearer one.
            triangles = 2.0 ** (exponent - 0.5)
            return self.raster(probes, triangles, face) <= self.trace(probes, triangles, face)

        powers = range(2, MOST.bit_length())
        leads = [exponent for exponent in powers if rasterising_leads(exponent)]
        return 2 ** leads[-1] if leads else 0
