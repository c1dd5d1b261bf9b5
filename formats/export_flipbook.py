# SPDX-License-Identifier: GPL-3.0-or-later
"""One EXR image with all probes, for engines of one's own: tiles of nx × ny probes, slices across, coefficients down.

::

             k = 0    k = 1    …  nz−1
    L00     [nx×ny]  [nx×ny]  [nx×ny]      RGB  radiance coefficient
    L1m1    [     ]                        A    1 active, 0 filled
    L10      …                             row j = 0 on top
"""

from __future__ import annotations

import numpy as np

from ..core.conventions import ACTIVE, coefficient_names
from .export_lattice import nearest_axes
from .openexr_file import write_image

AXES, PRECISION, BANDS, SUFFIX = "y-up", "half", 4, ".exr"
ENGINE = "any that reads EXR"
STORED = "radiance coefficients, orthonormal"
RUN_IN_ENGINE = False
DOES_NOT_CARRY = ["visibility weights", "gradients of probes", "culled and invalid told apart: alpha is 0 for both"]


def write(job) -> dict:
    lattice = nearest_axes(job.lattice)
    nx, ny, nz = lattice.grid.resolution
    count = lattice.coefficients.shape[1]
    pixels = np.empty((count, ny, nz, nx, 4), np.float32)
    pixels[..., :3] = lattice.coefficients.reshape(nz, ny, nx, count, 3).transpose(3, 1, 0, 2, 4)
    pixels[..., 3] = (lattice.state == ACTIVE).reshape(nz, ny, nx).transpose(1, 0, 2)
    write_image(job.path(".exr"), job.encode(pixels.reshape(count * ny, nz * nx, 4)))
    return {
        "tile": [nx, ny],
        "tiles": [nz, count],
        "rows_of_tiles": coefficient_names(lattice.bands),
        "resolution": [nx, ny, nz],
        "matrix": lattice.grid.matrix.tolist(),
        "matrix_is": "rows; box frame -1..1 to world, probes from face to face of the box",
        "alpha": "1 active, 0 culled or invalid",
    }
