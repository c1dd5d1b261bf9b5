# SPDX-License-Identifier: GPL-3.0-or-later
"""The conventions of docs/conventions.md as code: everything that fixes an order, a sign or a unit.

World space is Blender's: right-handed, Z up, metres. Light is linear RGB radiance. Spherical harmonics are real and
orthonormal, without the Condon-Shortley phase, ordered l(l+1)+m.

Cube faces, seen from the probe, in the cube's own frame, which CUBE_TURN maps to the world. A face point is
``forward + s·right + t·up`` with s, t in −1..1; texel column grows with s, row with t, texel centres at
half-integers::

    face  forward  right  up             +t
     0      +X      −Y    +Z              ^
     1      −X      +Y    +Z              |  N rows
     2      +Y      +X    +Z              |
     3      −Y      −X    +Z              +-----> +s, N columns
     4      +Z      +X    −Y      (the image that a camera at the probe sees when it
     5      −Z      +X    +Y       looks along forward with up as its up)
"""

import numpy as np

FORMAT_VERSION = (1, 2)  # of the probe file: readers refuse a newer major

# Cubes stand askew: edges of rooms are parallel to the axes, and would enter or leave a whole row of texels at once. In
# the gallery this takes a quarter off the error. Rational, by Euler and Rodrigues from (9, 2, 3, 2), so exactly a
# rotation.
CUBE_TURN = np.array([[72, -24, 62], [48, 82, -24], [-46, 48, 72]]) / 98
FACE_FORWARD = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float) @ CUBE_TURN.T
FACE_RIGHT = np.array([[0, -1, 0], [0, 1, 0], [1, 0, 0], [-1, 0, 0], [1, 0, 0], [1, 0, 0]], float) @ CUBE_TURN.T
FACE_UP = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, -1, 0], [0, 1, 0]], float) @ CUBE_TURN.T

MAX_BANDS = 4

# Beyond, squares and products of lengths leave what 32 bits hold.
MOST_REACH_M = 1e9

# Probe states, as stored in the file.
CULLED, ACTIVE, INVALID = 0, 1, 2

# Edge of the octahedral map of depth statistics that every probe carries for its visibility weights.
DEPTH_EDGE = 8
# Of a texel of that map, along an edge, what its 16 directions are spread over: the wider, the less a probe knows of
# where a wall ends.
DEPTH_SPREAD = 0.6

# Cosine lobe, per band: irradiance = Σ A_l L_lm Y_lm(n). Ramamoorthi and Hanrahan, "An Efficient Representation for
# Irradiance Environment Maps", SIGGRAPH 2001, eq. 8. The fourth band's factor is exactly zero.
COSINE_LOBE = np.array([np.pi, 2 * np.pi / 3, np.pi / 4, 0.0])

# Rec. 709 luminance of linear RGB.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def band_of(index: int) -> int:
    """Band l of coefficient ``index`` = l(l+1)+m."""
    return int(np.floor(np.sqrt(index)))


def bands_of(count: int) -> int:
    """Bands of a series with ``count`` = bands² coefficients."""
    return int(round(np.sqrt(count)))


def coefficient_names(bands: int) -> list[str]:
    """Channel names in coefficient order: L00, L1m1, L10, L11, L2m2 …"""
    names = []
    for l in range(bands):
        for m in range(-l, l + 1):
            names.append(f"L{l}{'m' if m < 0 else ''}{abs(m)}")
    return names
