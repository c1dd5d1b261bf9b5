# SPDX-License-Identifier: GPL-3.0-or-later
"""Fields whose light is different from every side and at every place, so that no swapped axis goes unnoticed."""

import numpy as np
from gridlight.core import spherical_harmonics as sh
from gridlight.core.conventions import CULLED
from gridlight.core.field import Field
from gridlight.core.grid import Grid

# One colour and strength for light from each of Blender's six directions.
SIDES = {
    (1, 0, 0): (9.0, 1.0, 0.5),
    (-1, 0, 0): (1.0, 2.0, 0.2),
    (0, 1, 0): (0.5, 7.0, 1.0),
    (0, -1, 0): (0.3, 1.0, 3.0),
    (0, 0, 1): (2.0, 3.0, 8.0),
    (0, 0, -1): (0.6, 0.4, 0.2),
}
TURN = np.linalg.qr(np.random.default_rng(11).normal(size=(3, 3)))[0]
TURN *= np.sign(np.linalg.det(TURN))


def box(size, center=(1.0, -2.0, 3.0), turn=None):
    """(4, 4) matrix of a box with edges ``size`` metres."""
    matrix = np.eye(4)
    matrix[:3, :3] = (np.eye(3) if turn is None else turn) * (np.array(size) / 2)
    matrix[:3, 3] = center
    return matrix


# Not square, not regular, and every kind of placement: name, matrix, resolution.
PLACEMENTS = {
    "straight": (box((4, 6, 3)), (3, 5, 4)),
    "quarter turn": (box((4, 6, 3), turn=np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])), (3, 5, 4)),
    "on its side, mirrored": (box((4, 6, 3), turn=np.array([[0, 0, 1.0], [0, -1, 0], [-1, 0, 0]])), (2, 5, 4)),
    "turned": (box((4, 6, 3), turn=TURN), (3, 5, 4)),
    "turned and mirrored": (box((4, 6, 3), turn=TURN * [1, -1, 1]), (5, 4, 6)),
}
STRAIGHT = ["straight", "quarter turn", "on its side, mirrored"]


def lit_field(matrix, resolution, bands=3, linear=True, seed=0):
    """A field of grid ``matrix``, ``resolution``: light from six sides that changes along every axis.

    ``linear``: linearly in space, so that every way to interpolate gives the same. Otherwise each probe differs at
    random. Nothing hides anything, and some probes are culled.
    """
    field = Field.empty(Grid(np.array(matrix, float), tuple(resolution), "Test “volume”"), bands)
    rng = np.random.default_rng(seed)
    lobes = np.array([sh.basis(np.array(side, float), bands) for side in SIDES])  # (6, K)
    colors = np.array(list(SIDES.values()))
    if linear:
        places = field.grid.positions() - field.grid.center
        growth = rng.uniform(-0.1, 0.1, (6, 3))
        strength = 1 + places @ growth.T  # (P, 6)
        assert strength.min() > 0
    else:
        strength = rng.uniform(0.3, 1.5, (field.grid.count, 6))
    field.coefficients[:] = np.einsum("ps,sk,sc->pkc", strength, lobes, colors)
    field.coefficients[:, 0] += 4.0  # keeps irradiance positive
    field.state[:: max(field.grid.count // 5, 2)] = CULLED
    field.depth[..., 0], field.depth[..., 1] = 1e3, 1e6
    field.metadata = {"scene_hash": "test"}
    return field


def places_inside(grid, count, share=1.0, seed=3):
    """(count, 3) world points in the middle ``share`` of the box, and as many unit normals."""
    rng = np.random.default_rng(seed)
    local = rng.uniform(-share, share, (count, 3))
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return local @ grid.matrix[:3, :3].T + grid.matrix[:3, 3], normals


def sample_volume(texture, coordinates):
    """(N, C) of ``texture`` (depth, height, width, C) at ``coordinates`` (N, 3) in 0..1, as a GPU filters linearly with
    clamped edges."""
    size = np.array(texture.shape[2::-1])
    place = coordinates * size - 0.5
    corner = np.floor(place).astype(int)
    share = place - corner
    result = np.zeros((len(coordinates), texture.shape[3]))
    for step in np.ndindex(2, 2, 2):
        x, y, z = np.clip(corner + step, 0, size - 1).T
        weight = np.where(step, share, 1 - share).prod(axis=1)
        result += weight[:, None] * texture[z, y, x]
    return result


Y_UP = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
UNITY = np.array([[-1, 0, 0], [0, 0, 1], [0, -1, 0]], float)
