# SPDX-License-Identifier: GPL-3.0-or-later
"""three.js: the atlas of its ``LightProbeGrid`` and ``LightProbeGridWebGL``, a loader and a viewer page.

Seven blocks of texels are stacked along Z, nz + 2 slices each, the first and last a copy of their neighbour. A probe's
27 numbers (9 coefficients, RGB) and a zero fill the four channels of its texel in the seven blocks::

    block   R    G    B    A          slice  0         copy of 1
      0    c0r  c0g  c0b  c1r                1 … nz    the probes, x fastest, then y
      1    c1g  c1b  c2r  c2g                nz + 1    copy of nz
      2    c2b  c3r  c3g  c3b
      …                               c = radiance, orthonormal: three.js applies the cosine lobe itself
      6    c8r  c8g  c8b   0

Against leaks three.js interpolates half a cell along the normal from the surface; ``refine`` makes cells smaller and so
brings it to the surface, where ``eval`` looks.

From r187 on a grid's box holds one cell around every probe, before that it ended at the outermost probes; the file
states both.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from .export_lattice import axis_aligned, cell_box

AXES, PRECISION, BANDS, SUFFIX = "y-up", "half", 3, None
ENGINE = "three.js r184 or later, LightProbeGrid (WebGPURenderer) or LightProbeGridWebGL (WebGLRenderer)"
STORED = "radiance coefficients, orthonormal; the shader applies the cosine lobe"
RUN_IN_ENGINE = True
DOES_NOT_CARRY = [
    "visibility weights: light leaks through walls thinner than a cell; three.js looks half a cell along the normal "
    "instead",
    "gradients of probes: between probes light is blended straight, coarser than in the preview; the command line's "
    "--refine follows them",
    "a rotated volume: it is resampled along the axes",
    "light outside the box of cells: three.js has none there, Gridlight continues the outermost probes",
    "which probes are culled or invalid",
]
ATLAS_VERSION = 1
_BLOCKS = 7
_VIEWER = Path(__file__).parent / "three_viewer"


def write(job) -> dict:
    lattice = job.straightened(*axis_aligned(job.lattice, job.options.refine))
    grid = lattice.grid
    texels = atlas(lattice.coefficients, grid.resolution)
    job.path(".bin").write_bytes(job.encode(texels).astype(f"<f{2 if job.encode.precision == 'half' else 4}").tobytes())
    extent = 2 * np.diag(grid.matrix)[:3]
    layout = {
        "version": ATLAS_VERSION,
        "atlas": f"{job.stem}.bin",
        "type": job.encode.precision,
        "byte_order": "little",
        "atlas_size": list(texels.shape[2::-1]),
        "resolution": list(grid.resolution),
        "center": grid.center.tolist(),
        "size": (2 * np.diag(cell_box(grid))[:3]).tolist(),
        "probe_extent": extent.tolist(),
    }
    job.path(".json").write_text(json.dumps({"format": "gridlight-three", **layout}, indent=2) + "\n", encoding="utf-8")
    for file in sorted(_VIEWER.iterdir()):
        if file.is_file():
            job.folder.path(file.name).write_bytes(file.read_bytes())
    return layout


def atlas(coefficients: np.ndarray, resolution: tuple[int, int, int]) -> np.ndarray:
    """(7·(nz + 2), ny, nx, 4) float32 texels of ``coefficients`` (P, K ≤ 9, 3) in flat node order."""
    nx, ny, nz = resolution
    numbers = np.zeros((nz, ny, nx, 4 * _BLOCKS), np.float32)
    numbers[..., : 3 * coefficients.shape[1]] = coefficients.reshape(nz, ny, nx, -1)
    blocks = numbers.reshape(nz, ny, nx, _BLOCKS, 4).transpose(3, 0, 1, 2, 4)
    return np.pad(blocks, ((0, 0), (1, 1), (0, 0), (0, 0), (0, 0)), mode="edge").reshape(-1, ny, nx, 4)
