# SPDX-License-Identifier: GPL-3.0-or-later
"""Places at which light is measured: points of patches, or texels by themselves."""

from __future__ import annotations

from dataclasses import dataclass

import gpu


@dataclass(frozen=True)
class Places:
    """``points``: ``each`` elements (position, packed normal) for every patch or texel. ``sheets``: the number of the
    sheet that each is part of, None in scenes without (core/sheets.py)."""

    points: gpu.types.GPUTexture
    each: int
    sheets: gpu.types.GPUTexture | None
