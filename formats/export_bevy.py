# SPDX-License-Identifier: GPL-3.0-or-later
"""Bevy: an ``IrradianceVolume``, six-sided ambient cubes in a KTX2 file.

The texture measures (nx, 2·ny, 3·nz): along z the sides X, Y and Z follow each other, along y first the positive and
then the negative side, as bevy_pbr's shader reads it (its documentation has the two the other way round). A side holds
irradiance / π of a surface that faces it in the world, whatever the volume's own rotation. Bevy blends three sides by
the squared normal (Mitchell, McTaggart and Green, "Shading in Valve's Source Engine", SIGGRAPH 2006).
"""

from __future__ import annotations

import numpy as np

from ..core import spherical_harmonics as sh
from . import ktx2
from .export_lattice import axis_aligned, cell_box, is_sheared, right_handed

AXES, PRECISION, BANDS, SUFFIX = "y-up", "half", 4, ".ktx2"
ENGINE = "Bevy 0.13 or later, IrradianceVolume"
STORED = "irradiance / pi of surfaces facing +X, -X, +Y, -Y, +Z, -Z"
RUN_IN_ENGINE = False
DOES_NOT_CARRY = [
    "visibility weights: light leaks through walls thinner than a cell",
    "gradients of probes: between probes light is blended straight, coarser than in the preview",
    "what lies between the six sides: a normal that is none of the axes sees a blend of three",
    "negative irradiance, where the series rings: cut at zero",
    "light outside the box of cells",
    "which probes are culled or invalid",
]


def write(job) -> dict:
    lattice = right_handed(job.lattice)
    if is_sheared(lattice):
        lattice = job.straightened(*axis_aligned(job.lattice))
    cubes = ambient_cubes(lattice.coefficients, lattice.grid.resolution)
    if job.encode.precision == "float":
        job.warnings.append("few GPUs filter 32-bit float textures, which Bevy needs here; half floats are the default")
    texels = np.ones((*cubes.shape[:3], 4), np.float32)
    texels[..., :3] = cubes
    ktx2.write_volume(job.path(".ktx2"), job.encode(texels))
    matrix = cell_box(lattice.grid)
    scale = 2 * np.linalg.norm(matrix[:3, :3], axis=0)
    return {
        "texture_size": list(cubes.shape[2::-1]),
        "resolution": list(lattice.grid.resolution),
        "transform": {
            "translation": matrix[:3, 3].tolist(),
            "rotation_xyzw": quaternion(2 * matrix[:3, :3] / scale).tolist(),
            "scale": scale.tolist(),
        },
        "intensity": "multiplies to cd/m²; take the factor by which the scene's lamps were multiplied",
    }


def ambient_cubes(coefficients: np.ndarray, resolution: tuple[int, int, int]) -> np.ndarray:
    """(3·nz, 2·ny, nx, 3) texels of ``coefficients`` (P, K, 3) in flat node order; not negative."""
    nx, ny, nz = resolution
    normals = np.stack([np.eye(3), -np.eye(3)], axis=1)  # [axis, sign]
    sides = sh.irradiance(coefficients[:, None, None], normals) / np.pi  # (P, axis, sign, 3)
    sides = np.maximum(sides, 0).reshape(nz, ny, nx, 3, 2, 3)
    return sides.transpose(3, 0, 4, 1, 2, 5).reshape(3 * nz, 2 * ny, nx, 3)


def quaternion(rotation: np.ndarray) -> np.ndarray:
    """(4,) unit quaternion x, y, z, w of a ``rotation`` matrix (3, 3): the eigenvector to the greatest eigenvalue of
    Bar-Itzhack's symmetric matrix ("New method for extracting the quaternion from a rotation matrix", 2000)."""
    m = rotation
    symmetric = np.array(
        [
            [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
            [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
            [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]],
        ]
    )
    result = np.linalg.eigh(symmetric)[1][:, -1]
    return result if result[3] >= 0 else -result
