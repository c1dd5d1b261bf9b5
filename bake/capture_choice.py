# SPDX-License-Identifier: GPL-3.0-or-later
"""Which way of capture is cheaper here, by a model that is measured once on every device and kept on disk.

The choice is the same in every run as long as the timings are kept: they depend on device, driver, Blender and what of
this program they were made with. Where they cannot be kept, every process measures anew; the crossover is rounded to a
power of two, so only a scene near the edge of such a step could then be captured one way now and the other way later.
"""

from __future__ import annotations

import os
import platform
from functools import cache

import bpy

from ..core import user_cache
from ..core.capture_cost import CaptureCost, Timings
from ..core.settings import BakeSettings
from ..gpu_shaders.capture_trial import time_captures
from ..gpu_shaders.context import device_description

_VERSION = 1  # of what is measured and how; kept timings of others count no more


def choose_capture(settings: BakeSettings, triangle_count: int, probe_count: int) -> tuple[str, str]:
    """("raster" or "trace", why). ``auto`` needs a GPU context; the first call on a device measures it."""
    if settings.capture != "auto":
        return settings.capture, f"capture by {settings.capture}, as asked for"
    cost = device_cost()
    probes, face = max(probe_count, 1), settings.face
    limit = cost.crossover(probes, face)
    method = "raster" if triangle_count <= limit else "trace"
    raster, trace = (1e3 * predict(probes, triangle_count, face) for predict in (cost.raster, cost.trace))
    return method, (
        f"capture by {method}: {triangle_count} triangles, and this device rasterises cheaper up to about {limit} "
        f"(predicted for {probes} probes: rasterising {raster:.3g} ms, rays {trace:.3g} ms)"
    )


@cache
def device_cost() -> CaptureCost:
    """The model of this device, measured where it is not known yet. Needs a GPU context."""
    key = " | ".join(
        (device_description(), f"Blender {bpy.app.version_string}", f"{platform.machine()}, {os.cpu_count()} cores")
    )
    timings, _ = user_cache.kept("capture", f"{key} | {_VERSION}", lambda values: Timings(**values), time_captures)
    return CaptureCost.fitted(timings)
