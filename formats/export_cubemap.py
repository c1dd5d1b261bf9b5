# SPDX-License-Identifier: GPL-3.0-or-later
"""What one probe holds, as pictures: a cube as a cross or six faces, or a panorama. All bands, radiance, EXR.

Faces as OpenGL, Vulkan and Direct3D lay them out, in the target's axes; the cross is seen from inside::

              [+Y]                 face    right   down          a face's picture: right grows to the right,
        [−X]  [+Z]  [+X]  [−Z]     +X, −X  −Z, +Z   −Y           down grows downwards; directions are
              [−Y]                 +Y      +X       +Z           forward + s·right + t·down, s and t in −1..1
                                   −Y      +X       −Z
                                   +Z, −Z  +X, −X   −Y

The panorama is the one of Blender's environment texture and of three.js: up on top, Blender's +X in the middle, +Y a
quarter from the left; it looks the same in every engine, so axes do not matter to it.
"""

from __future__ import annotations

import numpy as np

from ..core import spherical_harmonics as sh
from ..core.panorama import panorama_directions
from .export_lattice import axes_matrix
from .one_probe import choose_probe, place_of
from .openexr_file import write_image

AXES, PRECISION, BANDS, SUFFIX = "y-up", "half", 4, ".exr"
ENGINE = "any that reads EXR"
STORED = "radiance as the probe's bands tell it; where the series rings below zero, zero"
RUN_IN_ENGINE = False
DOES_NOT_CARRY = ["detail: four bands are a soft picture, made for rough reflections"]

FACE_NAMES = ("px", "nx", "py", "ny", "pz", "nz")
FORWARD = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
RIGHT = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [1, 0, 0], [1, 0, 0], [-1, 0, 0]], float)
DOWN = np.array([[0, -1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0, -1, 0], [0, -1, 0]], float)
_CROSS = {1: (1, 0), 4: (1, 1), 0: (1, 2), 5: (1, 3), 2: (0, 1), 3: (2, 1)}  # face: (row, column)


def write(job) -> dict:
    options = job.options
    node = choose_probe(job)
    coefficients = job.lattice.coefficients[node].astype(float)
    layout = {**place_of(job, node), "arrangement": options.layout}
    if options.layout == "equirect":
        turn = axes_matrix(AXES if options.axes is None else options.axes)
        directions = panorama_directions(2 * options.size, options.size)[::-1] @ turn.T
        write_image(job.path(".exr"), _picture(job, coefficients, directions))
        return layout
    faces = _picture(job, coefficients, face_directions(options.size))
    if options.layout == "faces":
        for name, face in zip(FACE_NAMES, faces):
            write_image(job.path(f"_{name}.exr"), face)
        return layout
    edge = options.size
    cross = np.zeros((3 * edge, 4 * edge, 3), faces.dtype)
    for face, (row, column) in _CROSS.items():
        cross[row * edge : (row + 1) * edge, column * edge : (column + 1) * edge] = faces[face]
    write_image(job.path(".exr"), cross)
    return layout


def face_directions(size: int) -> np.ndarray:
    """(6, size, size, 3) unit directions of the texels, in the target's axes, row 0 on top."""
    centre = (np.arange(size) + 0.5) * 2 / size - 1
    down, right = np.meshgrid(centre, centre, indexing="ij")
    places = right[..., None] * RIGHT[:, None, None] + down[..., None] * DOWN[:, None, None]
    directions = FORWARD[:, None, None] + places
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def _picture(job, coefficients: np.ndarray, directions: np.ndarray) -> np.ndarray:
    return job.encode(np.maximum(sh.radiance(coefficients, directions), 0))
