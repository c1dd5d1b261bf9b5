# SPDX-License-Identifier: GPL-3.0-or-later
"""Unity: JSON of ``SphericalHarmonicsL2`` values and the editor script that writes them into a scene's light probes.

Unity evaluates c0 + c1·y + c2·z + c3·x + c4·xy + c5·yz + c6·(3z² − 1) + c7·xz + c8·(x² − y²) and multiplies by albedo,
not albedo / π. So each coefficient is the radiance coefficient times its basis function's constant times A_l / π = 1,
2/3, 1/4.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from ..core.spherical_harmonics import POLYNOMIAL_FACTORS, cosine_lobe
from .export_numbers import listing

AXES, PRECISION, BANDS, SUFFIX = "unity", "float", 3, ".json"
ENGINE = "Unity 2019.4 or later, LightProbes, linear colour space"
STORED = "SphericalHarmonicsL2: irradiance / pi with the basis functions' constants folded in; 9 red, 9 green, 9 blue"
RUN_IN_ENGINE = False
DOES_NOT_CARRY = [
    "visibility weights: light leaks through walls thinner than a cell",
    "gradients of probes: between probes light is blended straight, coarser than in the preview",
    "trilinear interpolation: Unity blends four probes of its own tetrahedra",
    "light per pixel: Unity looks light probes up once per renderer, except with proxy volumes",
]
_SCRIPT = Path(__file__).parent / "unity" / "GridlightProbeImporter.cs"

SCALE = POLYNOMIAL_FACTORS * cosine_lobe(3) / np.pi


def write(job) -> dict:
    lattice = job.lattice
    grid = lattice.grid
    values = np.zeros((grid.count, 3, 9), np.float32)
    used = lattice.coefficients.shape[1]
    values[:, :, :used] = lattice.coefficients.transpose(0, 2, 1) * SCALE[:used]
    head = {
        "format": "gridlight-unity",
        "version": 1,
        "volume": grid.name,
        "resolution": list(grid.resolution),
        "worldToLattice": grid.world_to_lattice().ravel().tolist(),
    }
    text = json.dumps(head)[:-1] + (
        f',\n"state": [{listing(lattice.state)}]'
        f',\n"positions": [{listing(grid.positions().astype(np.float32))}]'
        f',\n"coefficients": [{listing(job.encode(values))}]}}\n'
    )
    job.path(".json").write_text(text, encoding="utf-8")
    job.folder.path(_SCRIPT.name).write_bytes(_SCRIPT.read_bytes())
    return {"script": f"{_SCRIPT.name}: put it into a folder called Editor", "order": "x fastest, then y, then z"}
