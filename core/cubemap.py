# SPDX-License-Identifier: GPL-3.0-or-later
"""Cubemap texels and the octahedral map: directions, exact solid angles, and their inverses.

GLSL twin: gpu_shaders/glsl/cubemap_lib.glsl. The face layout is drawn in core/conventions.py.
"""

from __future__ import annotations

import numpy as np

from .conventions import CUBE_TURN, FACE_FORWARD, FACE_RIGHT, FACE_UP


def _corner_integral(s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Solid angle of the face rectangle (0, 0)–(s, t) at distance 1."""
    return np.arctan2(s * t, np.sqrt(s * s + t * t + 1.0))


def texel_directions(face: int) -> np.ndarray:
    """(6, face, face, 3) unit directions through the texel centres, indexed [face, row, column]."""
    centre = (np.arange(face) + 0.5) * 2.0 / face - 1.0
    t, s = np.meshgrid(centre, centre, indexing="ij")
    axes = (a[:, None, None, :] for a in (FACE_FORWARD, FACE_RIGHT, FACE_UP))
    forward, right, up = axes
    directions = forward + s[None, :, :, None] * right + t[None, :, :, None] * up
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def place_directions(texel: np.ndarray, place: np.ndarray, face: int) -> np.ndarray:
    """(N, 3) unit directions through ``place`` (N, 2 or more; column, row; 0..1) of ``texel`` (N,), counted face by
    face, row by row."""
    side, row, column = texel // face**2, texel // face % face, texel % face
    s, t = (np.stack([column, row]) + place[:, :2].T) * 2.0 / face - 1.0
    directions = FACE_FORWARD[side] + s[:, None] * FACE_RIGHT[side] + t[:, None] * FACE_UP[side]
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def texel_solid_angles(face: int) -> np.ndarray:
    """(face, face) exact solid angles of one face's texels, steradian; six faces sum to 4π to rounding.

    The difference of corner integrals over the texel's rectangle, as in Filament's ``CubemapUtils::solidAngle`` after
    Manne Öhrström's note; exact because ∂²/∂s∂t atan2(st, √(s²+t²+1)) is the projected area element.
    """
    edge = np.arange(face + 1) * 2.0 / face - 1.0
    integral = _corner_integral(edge[None, :], edge[:, None])
    return np.diff(np.diff(integral, axis=0), axis=1)


def direction_to_texel(directions: np.ndarray, face: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(face index, row, column) of the texel that each of ``directions`` (…, 3) falls into."""
    directions = np.asarray(directions, float)
    in_cube = directions @ CUBE_TURN
    magnitude = np.abs(in_cube)
    axis = np.argmax(magnitude, axis=-1)
    negative = np.take_along_axis(in_cube, axis[..., None], -1)[..., 0] < 0
    index = 2 * axis + negative
    depth = np.take_along_axis(magnitude, axis[..., None], -1)[..., 0]
    s = np.einsum("...i,...i->...", directions, FACE_RIGHT[index]) / depth
    t = np.einsum("...i,...i->...", directions, FACE_UP[index]) / depth

    def texel(value):
        return np.clip(((value * 0.5 + 0.5) * face).astype(int), 0, face - 1)

    return index, texel(t), texel(s)


def octahedral_decode(uv: np.ndarray) -> np.ndarray:
    """Unit directions of octahedral coordinates ``uv`` (…, 2) in −1..1.

    Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 2014, listing 2.
    """
    u, v = np.moveaxis(np.asarray(uv, float), -1, 0)
    z = 1.0 - np.abs(u) - np.abs(v)
    fold = np.maximum(-z, 0.0)
    x = u - np.copysign(fold, u)
    y = v - np.copysign(fold, v)
    directions = np.stack([x, y, z], axis=-1)
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def octahedral_encode(directions: np.ndarray) -> np.ndarray:
    """Inverse of ``octahedral_decode``: (…, 3) unit directions to (…, 2) in −1..1."""
    directions = np.asarray(directions, float)
    x, y, z = np.moveaxis(directions / np.abs(directions).sum(axis=-1, keepdims=True), -1, 0)
    folded_x = np.copysign(1.0 - np.abs(y), x)
    folded_y = np.copysign(1.0 - np.abs(x), y)
    below = z < 0
    return np.stack([np.where(below, folded_x, x), np.where(below, folded_y, y)], axis=-1)


_NORMAL_STEPS = 2047.0


def pack_normal(uv: np.ndarray) -> np.ndarray:
    """Octahedral normals (…, 2) as one whole number each, which float32 holds exactly. Main axes survive exactly."""
    steps = np.rint(np.clip(uv, -1.0, 1.0) * _NORMAL_STEPS) + 2048.0
    return steps[..., 0] + 4096.0 * steps[..., 1]


def unpack_normal(packed: np.ndarray) -> np.ndarray:
    """(…, 3) unit normals."""
    high = np.floor(packed / 4096.0)
    uv = np.stack([packed - 4096.0 * high, high], axis=-1)
    return octahedral_decode((uv - 2048.0) / _NORMAL_STEPS)
