# SPDX-License-Identifier: GPL-3.0-or-later
"""What a probe knows of the distances around it: an octahedral map, from which the inverse distance in any direction is
read, and how far to be trusted.

A plane's inverse distance is linear in the direction, and texels are blended so that their directions come to the one
asked for: of a flat wall the blend errs nowhere, at whatever slant. Where two walls meet it does: a texel on each, and
what is between them cuts the edge off. Texels also know what they see in their middle, and its normal, so each is a
plane that goes on. Of walls that enclose the probe the nearest of these planes is the truth, in edges and corners too,
and nowhere nearer than the blend; of a thing that stands before another the plane goes on past its end, nearer than the
blend, and there the blend counts. So the farther of the two is taken. Where they agree, the probe sees what it knows to
be flat, and nothing is left of the spread that distances to a slanted wall have within a texel.

Where a wall ends within a texel, neither says on which side of the end a place lies. But a place that lies on one of
the planes and looks away from the probe is on the back of what that texel shows, and the probe cannot see it.
GLSL twin: lookup_lib.glsl, which is given ``sights``.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from .conventions import DEPTH_EDGE, DEPTH_SPREAD
from .cubemap import octahedral_decode, octahedral_encode, pack_normal, unpack_normal

DEPTH_VALUES = 4  # of a texel, see Field.depth
LEAST_DISTANCE = 1e-6  # of the depth clamp: what a surface at no distance counts as
LEAST_COSINE = 0.05  # between a texel's direction and its plane's normal: what is seen more edge-on counts as facing
NOT_FLAT = 5.0  # over this: how much nearer planes are than the blend where all of the spread counts
# Of the distance to a plane: what is as near to it lies on it, twice as far it does not. And the cosine from which on a
# normal is that of the plane's back.
ON_PLANE = 0.02
LIKE_BACK = 0.9
FARTHEST_PLANE = 1.1  # inverse distance, in those of the depth clamp: what is as far may be the background


class Sight(NamedTuple):
    """What texels know, in inverse distances, those of the depth clamp."""

    planes: np.ndarray  # (…, 3) v: of what is in the middle, and of the plane that it is part of, v · d along d
    mean: np.ndarray  # (…) over the texel
    variance: np.ndarray  # (…) within it, but for what the plane accounts for
    known: np.ndarray  # (…) bool: what is in the middle


def sight(depth: np.ndarray, clamp: float, texels: np.ndarray) -> Sight:
    """What ``depth`` (…, DEPTH_VALUES) of ``texels`` (…) says; ``clamp``: metres beyond which it does not look."""
    directions = map_directions()[texels]
    mean, variance = np.moveaxis(inverse_moments(depth[..., :2] / [clamp, clamp**2]), -1, 0)
    known = depth[..., 2] > 0
    middle = np.where(known, clamp / np.maximum(depth[..., 3], LEAST_DISTANCE * clamp), mean)
    away = np.where(known[..., None], -unpack_normal(np.maximum(depth[..., 2], 1.0)), directions)
    cosine = (away * directions).sum(axis=-1)
    edge_on = cosine < LEAST_COSINE
    away, cosine = np.where(edge_on[..., None], directions, away), np.where(edge_on, 1.0, cosine)
    planes = away * (middle / cosine)[..., None]
    own = np.einsum("...i,...ij,...j->...", planes, _texel_spread()[texels], planes)
    return Sight(planes, mean, np.where(known, np.maximum(variance - own, 0.0), variance), known)


def sights(depth: np.ndarray, clamp: float) -> np.ndarray:
    """(N, DEPTH_EDGE², 4) for shaders, of maps ``depth`` (N, DEPTH_EDGE², DEPTH_VALUES): packed normal n of the plane
    and l, so that it is l n; mean, negative where the plane is not known; variance."""
    found = sight(depth, clamp, np.arange(DEPTH_EDGE**2))
    length = np.linalg.norm(found.planes, axis=-1)
    packed = pack_normal(octahedral_encode(found.planes / length[..., None]))
    return np.stack([packed, length, np.where(found.known, found.mean, -found.mean), found.variance], axis=-1)


def inverse_moments(depth: np.ndarray) -> np.ndarray:
    """(…, 2) mean and variance of the inverse of a distance whose mean and mean square are ``depth`` (…, 2), to second
    order about the mean; a spread as large as the mean counts in full, no more."""
    mean = np.maximum(depth[..., 0].astype(float), LEAST_DISTANCE)
    spread = np.maximum(depth[..., 1] / mean**2 - 1.0, 0.0)
    return np.stack([(1.0 + np.minimum(spread, 1.0)) / mean, spread / mean**2], axis=-1)


def sample_inverse(
    depth: np.ndarray,
    clamp: float,
    nodes: np.ndarray,
    directions: np.ndarray,
    most: np.ndarray,
    place: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """(…, 3) inverse distance along ``directions`` (…, 3), in those of ``clamp`` metres, its variance, and how much the
    ``place``, metres from the probe (…, 3) and its normal (…, 3), is on the back of what is seen (0..1), by the
    ``depth`` (P, DEPTH_EDGE², DEPTH_VALUES) of ``nodes`` (…); of four texels, none of which counts as closer than
    ``most`` (…)."""
    position, scale = _blended_place(directions)
    corner = np.floor(position).astype(int)
    all_texels = np.arange(DEPTH_EDGE**2)
    ahead = sight(depth, clamp, all_texels) if len(depth) * len(all_texels) < 4 * nodes.size else None
    blended, spread, nearest, behind = (np.zeros(nodes.shape) for _ in range(4))
    for step, weight in _texel_weights(position - corner, corner).items():
        texel = _wrap_octahedral(corner + step)
        number = texel[..., 1] * DEPTH_EDGE + texel[..., 0]
        if ahead is None:
            found = sight(depth[nodes, number], clamp, number)
        else:
            found = Sight(*(values[nodes, number] for values in ahead))
        inverse = np.minimum(found.mean * scale * _texel_lengths()[number], most)
        blended += weight * inverse
        spread += weight * found.variance * (inverse / found.mean) ** 2
        further = np.minimum((found.planes * directions).sum(axis=-1), most)
        nearest = np.maximum(nearest, np.where(found.known, further, most))
        behind = np.maximum(behind, np.where(found.known, _on_back(found.planes, clamp, *place), 0.0))
    uneven = np.clip(NOT_FLAT * (nearest / blended - 1.0), 0.0, 1.0)
    return np.stack([np.minimum(blended, nearest), uneven * spread, behind], axis=-1)


def _on_back(planes: np.ndarray, clamp: float, offset: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """(…) how much a place ``offset`` (…, 3) metres from the probe lies on ``planes`` (…, 3) and its ``normal`` (…, 3)
    points where their backs do."""
    length = np.sqrt(np.einsum("...i,...i", planes, planes))
    away = np.einsum("...i,...i", planes, normal) > LIKE_BACK * length
    apart = np.abs(np.einsum("...i,...i", planes, offset) / clamp - 1.0)
    return np.where(away & (length > FARTHEST_PLANE), np.clip(2.0 - apart / ON_PLANE, 0.0, 1.0), 0.0)


def _blended_place(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where in the map (…, 2), in texels, four of them are blended to ``directions`` d (…, 3); and what the blend is to
    be multiplied by (…).

    Texels stand at o = d / |d|₁ on the octahedron, whose faces are flat in the map. Between texels on two sides of its
    edges x = 0 and y = 0, each half a texel from it, a blend cuts the edge off: what it means lies ``inside`` times as
    far from the octahedron's middle, and is to be looked up ``inside`` times as far from that of the map.
    """
    absolute = np.abs(directions)
    length = absolute.sum(axis=-1)
    flat = absolute[..., :2] / length[..., None]
    half = 1.0 / DEPTH_EDGE
    one_edge = (1.0 - half) / np.maximum(1.0 - flat.min(axis=-1), 1e-9)
    two_edges = (1.0 - 2.0 * half) / np.maximum(1.0 - flat.sum(axis=-1), 1e-9)
    inside = np.minimum(1.0, np.minimum(one_edge, two_edges))
    sign = np.where(directions[..., :2] < 0, -1.0, 1.0)
    upper = directions[..., 2:] >= 0
    place = sign * np.where(upper, inside[..., None] * flat, 1.0 - inside[..., None] * flat[..., ::-1])
    return (place * 0.5 + 0.5) * DEPTH_EDGE - 0.5, length / inside


def _texel_weights(blend: np.ndarray, corner: np.ndarray) -> dict[tuple[int, int], np.ndarray]:
    """Weights (…) of the four texels from ``corner`` (…, 2) on, by step from it, at ``blend`` (…, 2) between them:
    bilinear, or linear in each of two triangles where the octahedron's edge z = 0 cuts the four in half."""
    middle = 2 * (corner + 1) - DEPTH_EDGE
    turned = middle < 0
    x, y = np.moveaxis(np.where(turned, 1.0 - blend, blend), -1, 0)  # outwards from the middle of the map
    past = x + y - 1.0
    outermost = past > 0
    beside = np.where(outermost, 1.0 - y, x), np.where(outermost, 1.0 - x, y)
    triangles = np.stack([np.maximum(-past, 0.0), *beside, np.maximum(past, 0.0)])
    on_edge = np.abs(middle).sum(axis=-1) == DEPTH_EDGE
    weights = {}
    for step in np.ndindex(2, 2):
        out = turned ^ np.array(step, bool)
        linear = np.take_along_axis(triangles, (out[..., 0] + 2 * out[..., 1])[None], axis=0)[0]
        weights[step] = np.where(on_edge, linear, np.where(step, blend, 1.0 - blend).prod(axis=-1))
    return weights


@cache
def map_directions() -> np.ndarray:
    """(DEPTH_EDGE², 3) unit directions of texels' middles."""
    middle = (np.arange(DEPTH_EDGE) + 0.5) * (2.0 / DEPTH_EDGE) - 1.0
    return octahedral_decode(np.stack(np.meshgrid(middle, middle), axis=-1).reshape(-1, 2))


@cache
def sample_directions() -> np.ndarray:
    """(DEPTH_EDGE², 16, 3) unit directions in which statistics look, spread over DEPTH_SPREAD of a texel."""
    step = (np.arange(4) - 1.5) * (DEPTH_SPREAD / 4)
    column, row = np.meshgrid(np.arange(DEPTH_EDGE), np.arange(DEPTH_EDGE))
    place = np.stack(
        np.broadcast_arrays(column[..., None, None] + 0.5 + step, row[..., None, None] + 0.5 + step[:, None]), -1
    )
    return octahedral_decode(place.reshape(DEPTH_EDGE**2, 16, 2) * (2.0 / DEPTH_EDGE) - 1.0)


@cache
def _texel_spread() -> np.ndarray:
    """(DEPTH_EDGE², 3, 3) covariance of ``sample_directions`` within each texel."""
    apart = sample_directions() - sample_directions().mean(axis=1, keepdims=True)
    return np.einsum("tsi,tsj->tij", apart, apart) / apart.shape[1]


@cache
def _texel_lengths() -> np.ndarray:
    """(DEPTH_EDGE²,) |o| of texels' middles on the octahedron, which is one over the |d|₁ of their directions."""
    return 1.0 / np.abs(map_directions()).sum(axis=-1)


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
