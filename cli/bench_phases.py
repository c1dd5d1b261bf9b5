# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the time of a bake goes, by phase, with the GPU's work counted where it is ordered.

A stopwatch that waits for the GPU at the end of every piece of work, and a reporter that tells it which phase the bake
is in. The waits make a bake on a fast GPU a little slower than one that nobody watches.
"""

from __future__ import annotations

import time
from contextlib import contextmanager

from ..bake.result import Silent
from ..bake.stopwatch import Stopwatch
from ..gpu_shaders.textures import wait_for_gpu

# (phase of the reporter, phase of the stopwatch) -> name in tables
_NAMES = {
    ("upload", "setup"): "hierarchy, upload",
    ("upload", "cull"): "culling, placement",
    ("capture", "cull"): "culling, placement",
    ("capture", "capture"): "capture",
    ("capture", "light"): "finding patches",
    ("light", "light"): "light of patches",
    ("light", "capture"): "capture",
    ("project", "light"): "field",
    ("gather", "light"): "gather",
}
NAMES = ("read", *dict.fromkeys(_NAMES.values()))


class PhaseClock(Silent, Stopwatch):
    """``phases``: seconds by name, one of NAMES where it is known. Also the bake's reporter, a silent one.

    ``is_watching``: without it nothing is waited for and nothing noted, for times that nobody disturbs."""

    def __init__(self):
        Stopwatch.__init__(self, {})
        self.phases: dict[str, float] = {}
        self.is_watching = True
        self._now = ""

    @contextmanager
    def __call__(self, phase: str):
        if not self.is_watching:
            yield
            return
        wait_for_gpu()
        start = time.perf_counter()
        yield
        wait_for_gpu()
        spent = time.perf_counter() - start
        name = _NAMES.get((self._now, phase), f"{self._now}: {phase}")
        self.phases[name] = self.phases.get(name, 0.0) + spent
        self.seconds[phase] = self.seconds.get(phase, 0.0) + spent

    def phase(self, name: str, total: int | None = None) -> None:
        self._now = name
