# SPDX-License-Identifier: GPL-3.0-or-later
"""The field's lookup, readable and slow: what iterations, preview, ``eval`` and exporters agree on.

Irradiance at a point is the trilinear blend of the eight probes around it, each led to the point by half of its
gradient: two first-order expansions so blended reproduce the second order as well. Where probes are hidden, what is
left of the blend means another place than the point, and gradients lead the rest of the way. Each probe is weighted by
whether it sees the point: Chebyshev's inequality on the distances in its octahedral map (Donnelly and Lauritzen, I3D
2006; Majercik et al., JCGT 2019), asked of inverse distances and knowing of planes (core/depth_map.py). Points are
moved off their surface by a share of the distance to the probe, because a map is as coarse as it is far from what it
shows. There is no weight for the surface's orientation: it would bend the interpolation in open space, and a probe
behind a wall is already found by its depth. Culled probes hang in free air, have no statistics and count as seen. Where
none of the eight sees much of the point, as in a room in which hardly a node stands, those one step around the cell are
asked, too. Points outside the box are clamped to it, but gradients lead on for half a cell. GLSL twin: lookup_lib.glsl
and field_lib.glsl.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import spherical_harmonics as sh
from .conventions import ACTIVE, INVALID
from .depth_map import sample_inverse
from .field import Field
from .gradients import per_cell
from .grid import Grid

LEAST_WEIGHT = 1e-24  # of an active probe that does not see the point: decides only where none does
INVALID_WEIGHT = 1e-27  # of probes inside solids, which carry their neighbours' light
# Where the corners of a cell see less of a point than this, the nodes around the cell are asked, too; theirs is the
# weight of a node one cell away. So a probe that truly sees a point counts more than a nearer one that hardly does, and
# nothing jumps where they come in.
SEEN_ENOUGH = 2e-2
AROUND_WEIGHT = 5e-4
ON_BORDER = 1e-4  # of a cell: what is as near to a border lies on it, or rounding would choose between unseen and seen
BEYOND = 0.5  # cells along each axis, past the box and in all, that gradients lead on
# Of the distance to the probe: how far points are moved along their normal before they are tested, so that their own
# surface does not hide them. As far may places in free space look through a wall that they face.
OFF_SURFACE = 0.04
# Left of the chance of a place that is on the back of what the probe sees.
ON_BACK = 1e-6
# Times as close as the point: what is closer hides it no more. A probe beside a wall has it in the texels next to those
# that look along it, a hundred times as close as anything there.
HIDES = 4.0
# Inverse distance, in those of the depth clamp: what is farther counts as this far. Where all texels are at the clamp,
# blends of them are up to 1.08, as flat as between points of a wall.
FARTHEST = 1.1
_SHARPNESS = 10  # power of the chance
_POINTS_AT_ONCE = 1 << 13
_CORNERS = np.array([[corner & 1, corner >> 1 & 1, corner >> 2] for corner in range(8)])
_NEIGHBOURS = np.array([[node & 3, node >> 2 & 3, node >> 4] for node in range(64)]) - 1
_AROUND = _NEIGHBOURS[((_NEIGHBOURS < 0) | (_NEIGHBOURS > 1)).any(axis=1)]  # a cell: one step from its corners


def depth_clamp(grid: Grid) -> float:
    """Metres beyond which depth statistics do not look: one and a half diagonals of a cell."""
    return 1.5 * float(np.linalg.norm(grid.cell_size()))


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
    info[4, 0] = least_deviation(grid)
    return info


@dataclass(frozen=True)
class Weights:
    """What makes up the field at N points, of M of which the corners of their cells see too little. Of each point all
    weights together sum to 1."""

    corners: np.ndarray  # (N, 8) nodes
    of_corners: np.ndarray  # (N, 8)
    lacking: np.ndarray  # (M,) points
    around: np.ndarray  # (M, 56) nodes around their cells
    of_around: np.ndarray  # (M, 56)


def lookup_weights(field: Field, points: np.ndarray, normals: np.ndarray) -> Weights:
    """For world ``points`` (N, 3) on surfaces with ``normals`` (N, 3)."""
    corners, plain = trilinear(field.grid, points)
    weights = plain * _seen(field, corners, points, normals)
    total = weights.sum(axis=1)
    lacking = np.flatnonzero((total < SEEN_ENOUGH) & (plain.max(axis=1) < 1.0))  # a node's light is its own
    around, of_around = _around(field, points[lacking], normals[lacking])
    of_around *= 1.0 - total[lacking, None] / SEEN_ENOUGH
    total[lacking] += of_around.sum(axis=1)
    return Weights(corners, weights / total[:, None], lacking, around, of_around / total[lacking, None])


def _seen(field: Field, nodes: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N, K) what ``nodes`` (N, K) count by how likely they see their point of ``points`` (N, 3)."""
    state = field.state[nodes]
    seen = np.where(state == ACTIVE, np.maximum(visibility(field, nodes, points, normals), LEAST_WEIGHT), 1.0)
    return np.where(state == INVALID, INVALID_WEIGHT, seen)


def _around(field: Field, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 56) one step around the cells of ``points`` (N, 3), and their weights (N, 56): active ones that see the
    point, by the inverse fourth power of the distance in cells; none from where depth maps do not look as far."""
    cell, blend, _beyond = _place(field.grid, points)
    resolution = np.array(field.grid.resolution)
    at = cell[:, None] + _AROUND
    node = np.clip(at, 0, resolution - 1)
    nodes = node[..., 0] + resolution[0] * (node[..., 1] + resolution[1] * node[..., 2])
    squared = ((blend[:, None] - _AROUND) ** 2).sum(axis=2)
    apart = np.linalg.norm(points[:, None] - (field.grid.positions()[nodes] + field.offset[nodes]), axis=2)
    known = (at == node).all(axis=2) & (field.state[nodes] == ACTIVE) & (FARTHEST * apart <= depth_clamp(field.grid))
    weights = np.where(known, AROUND_WEIGHT / squared**2, 0.0)
    for first in range(0, len(_AROUND), 8):
        eight = slice(first, first + 8)
        weights[:, eight] *= _seen(field, nodes[:, eight], points, normals)
    return nodes, weights


def trilinear(grid: Grid, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (N, 8) around ``points`` (N, 3), clamped to the box, and their plain weights (N, 8), which sum to 1."""
    cell, blend, _beyond = _place(grid, points)
    resolution = np.array(grid.resolution)
    weights = np.where(_CORNERS, blend[:, None], 1 - blend[:, None]).prod(axis=2)
    node = np.minimum(cell[:, None] + _CORNERS, resolution - 1)
    return node[..., 0] + resolution[0] * (node[..., 1] + resolution[1] * node[..., 2]), weights


def gradient_steps(grid: Grid, points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(N, 8, 3) cells along each axis for which gradients of the corners around ``points`` (N, 3) are followed, BEYOND
    at most: half of the way from the node to the point clamped to the box; from where the ``weights`` (N, 8) blend
    nodes to, if that is not the point because some are hidden, half of the way as well; and all of it past the box. So
    light that is linear is reproduced whichever probes are left."""
    _cell, blend, beyond = _place(grid, points)
    halfway = 0.5 * (blend[:, None] - _CORNERS)
    rest = np.einsum("nw,nwa->na", weights, halfway)  # none for trilinear weights
    return np.clip(halfway + (rest + np.clip(beyond, -BEYOND, BEYOND))[:, None], -BEYOND, BEYOND)


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


def visibility(field: Field, nodes: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N, K) chance that each of ``nodes`` (N, K) sees its point of ``points`` (N, 3) on a surface with ``normals`` (N,
    3)."""
    place = points[:, None] - (field.grid.positions()[nodes] + field.offset[nodes]), normals[:, None]
    offset = place[0] + OFF_SURFACE * np.linalg.norm(place[0], axis=2, keepdims=True) * place[1]
    distance = np.linalg.norm(offset, axis=2)
    away = distance > 0
    direction = np.where(away[..., None], offset, [0, 0, 1]) / np.where(away, distance, 1)[..., None]
    clamp = depth_clamp(field.grid)
    inverse_there = np.maximum(clamp / np.where(away, distance, 1), FARTHEST)
    found = sample_inverse(field.depth, clamp, nodes, direction, HIDES * inverse_there, place)
    inverse, variance, behind = np.moveaxis(found, -1, 0)
    beyond = inverse - inverse_there
    least = least_deviation(field.grid) / clamp * inverse * inverse_there
    variance = np.maximum(variance, least**2)
    chance = np.where(beyond > 0, variance / (variance + beyond * beyond), 1.0)
    return np.where(away, chance**_SHARPNESS * (1.0 - (1.0 - ON_BACK) * behind), 1.0)


def irradiance(field: Field, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N, 3) irradiance at world ``points`` (N, 3) with unit ``normals`` (N, 3). Not clamped: may ring below zero."""
    points, normals = np.asarray(points, float), np.asarray(normals, float)
    result = np.empty((len(points), 3))
    gradient = per_cell(field.grid, field.gradient)
    for start in range(0, len(points), _POINTS_AT_ONCE):
        part = slice(start, start + _POINTS_AT_ONCE)
        found = lookup_weights(field, points[part], normals[part])
        blended = _blended(field, found.corners, found.of_corners)
        for first in range(0, found.around.shape[1], 8):
            eight = slice(first, first + 8)
            blended[found.lacking] += _blended(field, found.around[:, eight], found.of_around[:, eight])
        steps = gradient_steps(field.grid, points[part], found.of_corners) * found.of_corners[..., None]
        led = np.einsum("nwa,nwakc->nkc", steps, gradient[found.corners])
        blended[:, : led.shape[1]] += led
        result[part] = sh.irradiance(blended, normals[part])
    return result


def _blended(field: Field, nodes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(N, K, 3) coefficients of ``nodes`` (N, 8), by ``weights`` (N, 8)."""
    return np.einsum("nw,nwkc->nkc", weights, field.coefficients[nodes].astype(float))
