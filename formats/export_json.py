# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain JSON with everything an engine can use: positions, states, coefficients."""

from __future__ import annotations

import json

from ..core.conventions import ACTIVE, CULLED, INVALID, coefficient_names
from .export_numbers import listing

AXES, PRECISION, BANDS, SUFFIX = "blender", "float", 4, ".json"
ENGINE = "any"
STORED = "radiance coefficients, orthonormal; multiply band l by pi, 2pi/3, pi/4, 0 for irradiance"
RUN_IN_ENGINE = False
DOES_NOT_CARRY = ["visibility weights and gradients of probes (they stay in the probe file)"]


def write(job) -> dict:
    lattice = job.lattice
    grid = lattice.grid
    head = {
        "format": "gridlight-json",
        "version": 1,
        "volume": grid.name,
        "resolution": list(grid.resolution),
        "matrix": grid.matrix.tolist(),
        "coefficient_names": coefficient_names(lattice.bands),
        "states": {"culled": CULLED, "active": ACTIVE, "invalid": INVALID},
    }
    text = json.dumps(head)[:-1] + (
        f',\n"state": [{listing(lattice.state)}]'
        f',\n"positions": [{listing(grid.positions())}]'
        f',\n"coefficients": [{listing(job.encode(lattice.coefficients))}]}}\n'
    )
    job.path(".json").write_text(text, encoding="utf-8")
    return {"order": "x fastest, then y, then z; per probe coefficient by coefficient, each R, G, B"}
