# SPDX-License-Identifier: GPL-3.0-or-later
"""Which way of capture is cheaper here."""

from __future__ import annotations

from ..core.settings import BakeSettings

RASTER_LIMIT = 4000  # triangles; where the two cost the same on software OpenGL, see docs/measurements.md


def choose_capture(settings: BakeSettings, triangle_count: int) -> tuple[str, str]:
    """("raster" or "trace", why)."""
    if settings.capture != "auto":
        return settings.capture, f"capture by {settings.capture}, as asked for"
    method = "raster" if triangle_count <= RASTER_LIMIT else "trace"
    return method, f"capture by {method}: {triangle_count} triangles, rasterising is cheaper up to {RASTER_LIMIT}"
