# SPDX-License-Identifier: GPL-3.0-or-later
"""The field's lookup, readable and slow: what iterations, preview, ``eval`` and exporters agree on.

Irradiance at a point is the trilinear blend of the eight probes around it, each led to the point by half of its
gradient: two first-order expansions so blended reproduce the second order as well. Each is weighted by whether it sees
the point: Chebyshev's inequality on the depth moments of its octahedral map (Donnelly and Lauritzen, I3D 2006; Majercik
et al., JCGT 2019), asked of inverse distances. A plane's inverse distance is linear in the direction, so what is
blended between texels lies on the wall, where a mean of distances at a slant lies behind it. There is no weight for the
surface's orientation: it would bend the interpolation in open space, and a probe behind a wall is already found by its
depth. Culled probes hang in free air, have no statistics and count as seen. Points outside the box are clamped to it,
but gradients lead on for half a cell. GLSL twin: lookup_lib.glsl and field_lib.glsl.
"""

from __future__ import annotations

import numpy as np

from . import spherical_harmonics as sh
from .conventions import ACTIVE, DEPTH_EDGE, INVALID
from .cubemap import octahedral_encode
from .field import Field
from .gradients import per_cell
from .grid import Grid

LEAST_WEIGHT = 1e-24  # of an active probe that does not see the point: decides only where none does
INVALID_WEIGHT = 1e-27  # of probes inside solids, which carry their neighbours' light
ON_BORDER = 1e-4  # of a cell: what is as near to a border lies on it, or rounding would choose between unseen and seen
BEYOND = 0.5  # cells past the box that gradients lead on
_SHARPNESS = 12  # power of the chance
LEAST_DISTANCE = 1e-6  # of the depth clamp: what a surface at no distance counts as
_POINTS_AT_ONCE = 1 << 13
_CORNERS = np.array([[corner & 1, corner >> 1 & 1, corner >> 2] for corner in range(8)])


def depth_clamp(grid: Grid) -> float:
    """Metres beyond which depth statistics do not look: one and a half diagonals of a cell."""
    return 1.5 * float(np.linalg.norm(grid.cell_size()))


def visibility_bias(grid: Grid) -> float:
    """Metres that a point is moved along its normal before it is tested, so that its own surface does not hide it. As
    far it may look through a wall that it faces, where it is not on a surface."""
    return 0.08 * float(grid.cell_size().min())


def least_deviation(grid: Grid) -> float:
    """Metres of depth spread that are assumed even where a probe looks at a flat wall."""
    return 0.02 * float(grid.cell_size().min())


def grid_info(grid: Grid) -> np.ndarray:
    """(5, 4) float32: the block that lookup_lib.glsl reads, positions relative to the grid's centre."""
    info = np.zeros((5, 4), np.float32)
    to_lattice = grid.world_to_lattice()
    info[:3, :3] = to_lattice[:, :3]
    info[:3, 3] = to_lattice[:, :3] @ grid.center + to_lattice[:, 3]
    info[3] = (*grid.resolution, depth_clamp(grid))
    info[4, :2] = visibility_bias(grid), least_deviation(grid)
    return info


def lookup_weights(field: Field, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 8) and weights (N, 8), summing to 1, that make up the field at ``points`` (N, 3) with ``normals`` (N,
    3)."""
    nodes, weights = trilinear(field.grid, points)
    seen_points = points + normals * visibility_bias(field.grid)
    state = field.state[nodes]
    seen = np.where(state == ACTIVE, np.maximum(visibility(field, nodes, seen_points), LEAST_WEIGHT), 1.0)
    weights = weights * np.where(state == INVALID, INVALID_WEIGHT, seen)
    return nodes, weights / weights.sum(axis=1, keepdims=True)


def trilinear(grid: Grid, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 8) around ``points`` (N, 3), clamped to the box, and their plain weights (N, 8), which sum to 1."""
    cell, blend, _beyond = _place(grid, points)
    resolution = np.array(grid.resolution)
    weights = np.where(_CORNERS, blend[:, None], 1 - blend[:, None]).prod(axis=2)
    node = np.minimum(cell[:, None] + _CORNERS, resolution - 1)
    return node[..., 0] + resolution[0] * (node[..., 1] + resolution[1] * node[..., 2]), weights


def gradient_steps(grid: Grid, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(N, 8, 3) cells along each axis for which gradients of the nodes around ``points`` (N, 3) are followed: half of
    the way from the node to the point clamped to the box, and up to half a cell on from there. All the less the further
    ``weights`` (N, 8) are from the trilinear ones, because few probes are left, and far ones."""
    _cell, blend, beyond = _place(grid, points)
    steps = 0.5 * (blend[:, None] - _CORNERS) + np.clip(beyond, -BEYOND, BEYOND)[:, None]
    share = np.minimum(weights, trilinear(grid, points)[1]).sum(axis=1)
    return steps * share[:, None, None]


def _place(grid: Grid, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First corner (N, 3) of the cell of ``points`` (N, 3), where in the cell they are (N, 3) in 0..1, and how many
    cells past the box (N, 3), signed."""
    resolution = np.array(grid.resolution)
    to_lattice = grid.world_to_lattice()
    lattice = points @ to_lattice[:, :3].T + to_lattice[:, 3]
    clamped = np.clip(lattice, 0, resolution - 1)
    cell = np.minimum(clamped.astype(int), np.maximum(resolution - 2, 0))
    blend = clamped - cell
    border = np.round(blend)
    return cell, np.where(np.abs(blend - border) < ON_BORDER, border, blend), lattice - clamped


def visibility(field: Field, nodes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, 8) chance that each of ``nodes`` (N, 8) sees its point of ``points`` (N, 3)."""
    probes = field.grid.positions()[nodes] + field.offset[nodes]
    offset = points[:, None] - probes
    distance = np.linalg.norm(offset, axis=2)
    away = distance > 0
    direction = np.where(away[..., None], offset, [0, 0, 1]) / np.where(away, distance, 1)[..., None]
    clamp = depth_clamp(field.grid)
    inverse, variance = np.moveaxis(_sample_inverse(field.depth / [clamp, clamp**2], nodes, direction), -1, 0)
    inverse_there = np.maximum(clamp / np.where(away, distance, 1), 1.0)
    beyond = inverse - inverse_there
    least = least_deviation(field.grid) / clamp * inverse * inverse_there
    variance = np.maximum(variance, least**2)
    chance = variance / (variance + beyond * beyond)
    return np.where(away & (beyond > 0), chance**_SHARPNESS, 1.0)


def irradiance(field: Field, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N, 3) irradiance at world ``points`` (N, 3) with unit ``normals`` (N, 3). Not clamped: may ring below zero."""
    points, normals = np.asarray(points, float), np.asarray(normals, float)
    result = np.empty((len(points), 3))
    gradient = per_cell(field.grid, field.gradient)
    for start in range(0, len(points), _POINTS_AT_ONCE):
        part = slice(start, start + _POINTS_AT_ONCE)
        nodes, weights = lookup_weights(field, points[part], normals[part])
        steps = gradient_steps(field.grid, points[part], weights) * weights[..., None]
        blended = np.einsum("nw,nwkc->nkc", weights, field.coefficients[nodes].astype(float))
        led = np.einsum("nwa,nwakc->nkc", steps, gradient[nodes])
        blended[:, : led.shape[1]] += led
        result[part] = sh.irradiance(blended, normals[part])
    return result


def inverse_moments(depth: np.ndarray) -> np.ndarray:
    """(…, 2) mean and variance of the inverse of a distance whose mean and mean square are ``depth`` (…, 2), to second
    order about the mean; a spread as large as the mean counts in full, no more."""
    mean = np.maximum(depth[..., 0].astype(float), LEAST_DISTANCE)
    spread = np.maximum(depth[..., 1] / mean**2 - 1.0, 0.0)
    return np.stack([(1.0 + np.minimum(spread, 1.0)) / mean, spread / mean**2], axis=-1)


def _sample_inverse(depth: np.ndarray, nodes: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(…, 2) bilinear sample of the inverse moments of octahedral ``depth`` (P, DEPTH_EDGE², 2) of ``nodes`` (…) along
    ``directions`` (…, 3)."""
    position = (octahedral_encode(directions) * 0.5 + 0.5) * DEPTH_EDGE - 0.5
    corner = np.floor(position).astype(int)
    blend = position - corner
    result = np.zeros((*nodes.shape, 2))
    for step in np.ndindex(2, 2):
        texel = _wrap_octahedral(corner + step)
        weight = np.where(step, blend, 1 - blend).prod(axis=-1)
        result = result + weight[..., None] * inverse_moments(depth[nodes, texel[..., 1] * DEPTH_EDGE + texel[..., 0]])
    return result


def _wrap_octahedral(texel: np.ndarray) -> np.ndarray:
    """Texels one step past the edge of the map, brought to where the sphere goes on."""
    texel = texel.copy()
    for axis in (0, 1):
        value = texel[..., axis]
        past = (value < 0) | (value >= DEPTH_EDGE)
        texel[..., 1 - axis] = np.where(past, DEPTH_EDGE - 1 - texel[..., 1 - axis], texel[..., 1 - axis])
        texel[..., axis] = np.where(
            value < 0, -1 - value, np.where(value >= DEPTH_EDGE, 2 * DEPTH_EDGE - 1 - value, value)
        )
    return texel
