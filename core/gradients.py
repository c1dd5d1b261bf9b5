# SPDX-License-Identifier: GPL-3.0-or-later
"""How a probe's light changes where the probe moves: the translational gradient of its coefficients.

Between texels a and b runs an edge of length l, in direction ω; the unit tangent m leads across it from a to b. A
probe that moves by t sees what is there move by −(t·m)/r, at the distance r of the nearer of the two, because that one
hides the other. So the gradient knows about occlusion and parallax::

    ∇c_lm = Σ over edges of (L_b − L_a) Y_lm(ω) l m / r

Ward and Heckbert, "Irradiance Gradients", EGRW 1992; Křivánek, Gautron, Pattanaik and Bouatouch, "Radiance Caching for
Efficient Global Illumination Computation", TVCG 2005. Gradients are of the bands that irradiance needs.
GLSL twins: field_gradient_comp.glsl, emission_project_comp.glsl.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from . import spherical_harmonics as sh
from .conventions import FACE_FORWARD, FACE_RIGHT, FACE_UP
from .cubemap import direction_to_texel, texel_directions
from .grid import Grid

LEAST_COSINE = 0.05  # at emitters: light that leaves them flatter changes faster than a probe's cell can use
_MOST_BANDS = 3  # the cosine lobe has no more
_NEAREST = 0.5  # of the shortest cell edge
MOST_CHANGE = 2.0  # of band 0, over one cell along each axis together
# Times what neighbours differ by. Light that changes faster does so by what is finer than a cell, as slats are, and a
# gradient tells nothing of half a cell away.
STEEPEST = 1.5


def gradient_bands(bands: int) -> int:
    """Bands of the gradient of a field with ``bands``."""
    return min(bands, _MOST_BANDS)


def least_distance(grid: Grid) -> float:
    """Metres: what is nearer to a probe counts as if it were this far. Its light changes within less than a cell, and a
    gradient says nothing about the rest of it."""
    return _NEAREST * float(grid.cell_size().min())


@dataclass(frozen=True)
class TexelEdges:
    """All E = 12·face² edges between texels of a cube, each once. Texels count face by face, row by row."""

    first: np.ndarray  # (E,) texel
    second: np.ndarray  # (E,) texel across the edge
    direction: np.ndarray  # (E, 3) unit, through the middle of the edge
    across: np.ndarray  # (E, 3) tangent from first to second, as long as the edge is wide in radians


@cache
def texel_edges(face: int) -> TexelEdges:
    """The edges of cubes with ``face`` texels along a face's edge, the same object every time. Edges are great
    circles."""
    place = np.arange(face + 1) * 2.0 / face - 1.0
    forward, right, up = (axes[:, None, None, :] for axes in (FACE_FORWARD, FACE_RIGHT, FACE_UP))
    corners = forward + place[:, None] * right + place[:, None, None] * up  # [face, row, column]
    corners /= np.linalg.norm(corners, axis=-1, keepdims=True)
    low, high = slice(None, -1), slice(1, None)
    centre = texel_directions(face).reshape(-1, 3)
    texel = np.arange(len(centre))
    sides = []
    for start, end in (
        (corners[:, low, low], corners[:, high, low]),
        (corners[:, low, high], corners[:, high, high]),
        (corners[:, low, low], corners[:, low, high]),
        (corners[:, high, low], corners[:, high, high]),
    ):
        start, end = start.reshape(-1, 3), end.reshape(-1, 3)
        middle = start + end
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        normal = np.cross(start, end)
        sine = np.linalg.norm(normal, axis=1)
        length = np.arctan2(sine, np.einsum("ei,ei->e", start, end))
        outward = -np.sign(np.einsum("ei,ei->e", normal, centre))
        across = normal * (outward * length / sine)[:, None]
        index, row, column = direction_to_texel(middle + across * 1e-3, face)
        beyond = (index * face + row) * face + column
        once = texel < beyond
        sides.append((texel[once], beyond[once], middle[once], across[once]))
    return TexelEdges(*(np.concatenate(parts) for parts in zip(*sides)))


def edge_gradient(
    edges: TexelEdges, radiance: np.ndarray, distance: np.ndarray, inside: np.ndarray, nearest: float, bands: int
) -> np.ndarray:
    """(P, 3, K, 3) change per metre along the world's axes of the K = ``bands``² coefficients of P probes, of which
    texels send ``radiance`` (P, X, 3) from ``distance`` (P, X) metres, infinite where that is background. Distances
    count as ``nearest`` metres at least.

    Texels ``inside`` (P, X) bool, dark back faces, have no edges: a probe on a solid's surface would go for its inside,
    which nothing that asks for light lies in.
    """
    closeness = 1.0 / np.maximum(distance, nearest)
    speed = np.maximum(closeness[:, edges.first], closeness[:, edges.second])
    speed[inside[:, edges.first] | inside[:, edges.second]] = 0.0
    jump = (radiance[:, edges.second] - radiance[:, edges.first]) * speed[..., None]
    return np.einsum("ei,ek,pec->pikc", edges.across, sh.basis(edges.direction, bands), jump, optimize=True)


def point_gradient(
    direction: np.ndarray, distance: np.ndarray, normal: np.ndarray, flux: np.ndarray, nearest: float, bands: int
) -> np.ndarray:
    """(3, K, 3) change per metre of the coefficients Σ flux·Y of points on surfaces, seen along ``direction`` (N, 3)
    from ``distance`` (N,) metres.

    ``flux`` (N, 3) is radiance times area times cosine over distance², and all of it changes: with o the way from probe
    to point and n the point's ``normal`` (N, 3), −∂/∂o of (o·n) |o|⁻³ Y(o/|o|), divided by what it is the derivative
    of but for Y, is ((3 ω − n/(ω·n)) Y − ∇Y) / |o|.
    """
    cosine = np.einsum("ni,ni->n", direction, normal)
    flat = np.copysign(np.maximum(np.abs(cosine), LEAST_COSINE), cosine)
    turn = 3.0 * direction - normal / flat[:, None]
    change = sh.basis(direction, bands)[..., None] * turn[:, None, :] - sh.basis_gradient(direction, bands)
    return np.einsum("nki,nc->ikc", change, flux / np.maximum(distance, nearest)[:, None])


def per_cell(grid: Grid, gradient: np.ndarray) -> np.ndarray:
    """(P, 3, K, 3) change over one cell along each of the grid's axes, from ``gradient`` (P, 3, K, 3) per metre along
    the world's; 0 along axes with one node, where there is no cell to cross."""
    return np.einsum("ia,pikc->pakc", cell_axes(grid), np.asarray(gradient, float))


def cell_axes(grid: Grid) -> np.ndarray:
    """(3, 3) metres: columns are one cell along each of the grid's axes, 0 along axes with one node."""
    steps = np.array(grid.resolution) - 1
    return np.where(steps > 0, 2.0 * grid.matrix[:3, :3] / np.maximum(steps, 1), 0.0)


def limited(grid: Grid, gradient: np.ndarray, coefficients: np.ndarray, known: np.ndarray) -> np.ndarray:
    """``gradient`` (P, 3, K, 3) of ``coefficients`` (P, …, 3), as steep as they allow: along each axis of the grid by
    ``steepness`` of ``known`` (P,) bool probes; then scaled down where a lookup would change band 0 by more than
    itself. A lookup follows a gradient over half a cell along each axis at most, so what it reads of a probe cannot
    turn negative. By colour, all bands alike."""
    along = per_cell(grid, gradient)
    share = steepness(grid, along, coefficients, known)
    gradient, steep = gradient.copy(), np.flatnonzero((share < 1.0).any(axis=1))
    cut = (1.0 - share[steep])[..., None, None] * along[steep]
    gradient[steep] -= np.einsum("pakc,ai->pikc", cut, np.linalg.pinv(cell_axes(grid))).astype(gradient.dtype)
    change = (share[..., None] * np.abs(along[:, :, 0])).sum(axis=1)
    most = MOST_CHANGE * np.abs(np.asarray(coefficients[:, 0], float))
    scale = np.where(change > most, most / np.where(change > 0, change, 1.0), 1.0)
    return (gradient * scale[:, None, None]).astype(gradient.dtype)


def steepness(grid: Grid, along: np.ndarray, coefficients: np.ndarray, known: np.ndarray) -> np.ndarray:
    """(P, 3) share of the change ``along`` (P, 3, K, 3) each of the grid's axes, over a cell, that STEEPEST times the
    larger difference to the two neighbours there allows, as norms of irradiance; 1 where the probe or both neighbours
    are not ``known`` (P,)."""
    lobe = sh.cosine_lobe(_MOST_BANDS)[: along.shape[2]]
    slope = np.sqrt(np.einsum("pakc,pakc->pak", along, along) @ lobe**2)
    nodes = grid.resolution[::-1]  # arrays over them are ordered z, y, x
    light = (coefficients[:, : len(lobe)] * lobe[:, None]).reshape(*nodes, -1)
    known = known.reshape(nodes)
    most = np.full((*nodes, 3), -1.0)
    for axis in range(3):
        first, second = (np.moveaxis(most[..., axis], 2 - axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        apart = np.diff(np.moveaxis(light, 2 - axis, 0), axis=0)
        both = np.moveaxis(known, 2 - axis, 0)
        difference = np.where(both[:-1] & both[1:], np.sqrt(np.einsum("...i,...i", apart, apart)), -1.0)
        for end in (first, second):
            np.maximum(end, difference, out=end)
    most = STEEPEST * most.reshape(-1, 3)
    too_steep = (most >= 0) & (slope > most)
    return np.where(too_steep, most / np.where(too_steep, slope, 1.0), 1.0)
