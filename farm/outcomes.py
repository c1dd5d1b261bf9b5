# SPDX-License-Identifier: GPL-3.0-or-later
"""Outcomes of blocks as outputs of shards. Needs no Blender."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..bake.outcome import ARRAYS, BlockOutcome
from . import container

_VALUES = ("moved", "patches", "iterations", "converged", "missing", "reason", "energy", "change")


def describe_outcomes(outcomes: dict[int, BlockOutcome]) -> tuple[dict, dict]:
    """Header and arrays of an output for ``outcomes`` by block."""
    blocks: list[dict] = []
    arrays: dict[str, np.ndarray] = {}
    for index, outcome in sorted(outcomes.items()):
        blocks.append({"index": index, **{name: _finite(getattr(outcome, name)) for name in _VALUES}})
        arrays |= {f"{index}/{name}": getattr(outcome, name) for name in ARRAYS}
    return {"blocks": blocks}, arrays


def read_outcomes(path: Path) -> list[tuple[int, BlockOutcome]]:
    """(block, outcome) of all blocks in an output, which has been checked."""
    header, arrays = container.arrays(path)
    result = []
    for block in header["blocks"]:
        index = block.pop("index")
        values: dict = {name: arrays[f"{index}/{name}"] for name in ARRAYS}
        for name, value in block.items():
            values[name] = tuple(map(float, value)) if isinstance(value, list) else value
        values["missing"] = float(values["missing"])
        result.append((index, BlockOutcome(**values)))
    return result


def _finite(value):
    """JSON knows no infinity: light that grows without end is a text, which ``float`` reads again."""
    if isinstance(value, tuple):
        return [_finite(item) for item in value]
    return str(value) if isinstance(value, float) and not np.isfinite(value) else value
