# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays against triangles: every pair tested (brute force), and a plain traversal of the hierarchy that counts its work.

Readable twins of gpu_shaders/glsl/ray_lib.glsl in float64, for tests and measurements. N rays, T triangles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .bvh import NODE_TEXELS, WIDTH, Hierarchy

IsHole = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""(triangles (K,), barycentric (K, 2), directions of the rays (K, 3)) -> (K,) bool: is nothing there for such a ray?"""

_PAIRS_AT_ONCE = 1 << 20
_STEP = 3.8e-6  # of a point's magnitude: 32 units in the last place of float32


@dataclass
class Hits:
    """The nearest hit of each ray: ``triangle`` (N,) is −1 and ``distance`` (N,) infinite where nothing is hit;
    ``barycentric`` (N, 2) are the weights of corners 1 and 2. ``distance`` is in lengths of the ray's direction."""

    distance: np.ndarray
    triangle: np.ndarray
    barycentric: np.ndarray


@dataclass
class TraversalCost:
    """What a traversal did per ray: nodes fetched (N,), triangles tested (N,) and the most entries its stack held
    (N,)."""

    nodes: np.ndarray
    triangles: np.ndarray
    stack: np.ndarray


def intersect(corners: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (…) and barycentrics (…, 2) of rays (…, 3) against triangles ``corners`` (…, 3, 3); infinite where
    missed.

    Leading shapes broadcast. Watertight and two-sided: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection",
    JCGT 2013. The triangle is sheared so that the ray runs along +z; the signs of three edge functions, which
    neighbours compute from the same numbers, decide.
    """
    axis = np.argmax(np.abs(directions), axis=-1)
    x, y, z = (axis + 1) % 3, (axis + 2) % 3, axis
    depth = _component(directions, z)
    shear_x, shear_y = _component(directions, x) / depth, _component(directions, y) / depth
    a, b, c = (corners[..., i, :] - origins for i in range(3))
    az, bz, cz = (_component(p, z) for p in (a, b, c))
    (ax, ay), (bx, by), (cx, cy) = (
        (_component(p, x) - shear_x * pz, _component(p, y) - shear_y * pz) for p, pz in ((a, az), (b, bz), (c, cz))
    )
    u, v, w = cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax
    determinant = u + v + w
    inside = (np.minimum(u, np.minimum(v, w)) >= 0) | (np.maximum(u, np.maximum(v, w)) <= 0)
    hit = inside & (determinant != 0)
    safe = np.where(hit, determinant, 1.0)
    distance = (u * az + v * bz + w * cz) / (depth * safe)
    return np.where(hit & (distance > 0), distance, np.inf), np.stack([v / safe, w / safe], axis=-1)


def _component(vectors: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """``vectors`` (…, 3) at ``axis`` (…), shapes broadcast."""
    shape = np.broadcast_shapes(vectors.shape[:-1], axis.shape)
    vectors = np.broadcast_to(vectors, (*shape, 3))
    return np.take_along_axis(vectors, np.broadcast_to(axis, shape)[..., None], -1)[..., 0]


def closest_hit(
    triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray, is_hole: IsHole | None = None
) -> Hits:
    """Nearest hit of rays ``origins``, ``directions`` (N, 3) among ``triangles`` (T, 3, 3), all pairs tested."""
    count = len(origins)
    hits = Hits(np.full(count, np.inf), np.full(count, -1), np.zeros((count, 2)))
    rays_at_once = max(1, _PAIRS_AT_ONCE // len(triangles))
    for start in range(0, count, rays_at_once):
        rays = slice(start, start + rays_at_once)
        distance, barycentric = intersect(triangles[None], origins[rays, None], directions[rays, None])
        if is_hole is not None:
            ray, triangle = np.nonzero(np.isfinite(distance))
            hole = is_hole(triangle, barycentric[ray, triangle], directions[rays][ray])
            distance[ray[hole], triangle[hole]] = np.inf
        nearest = distance.argmin(axis=1)
        row = np.arange(len(nearest))
        hits.distance[rays] = distance[row, nearest]
        hit = np.isfinite(hits.distance[rays])
        hits.triangle[rays] = np.where(hit, nearest, -1)
        hits.barycentric[rays] = np.where(hit[:, None], barycentric[row, nearest], 0.0)
    return hits


def any_hit(
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    limits: np.ndarray,
    is_hole: IsHole | None = None,
) -> np.ndarray:
    """(N,) bool: does each ray hit something nearer than its limit?"""
    return closest_hit(triangles, origins, directions, is_hole).distance < limits


def step_off(points: np.ndarray, normals: np.ndarray, towards: np.ndarray, distances: np.ndarray) -> np.ndarray:
    """(N, 3) starts of secondary rays at hit ``points`` (N, 3), positions relative to the volume's centre.

    The rounding error of a hit grows with its coordinates and with the ``distances`` (N,) of the ray that found it, so
    the step does too. ``towards`` (N, 3) points back to where that ray came from.
    """
    magnitude = np.maximum(np.abs(points).max(axis=1), distances)
    return points + (normals + towards) * (magnitude * _STEP)[:, None]


def leave_surface(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The same for points (N, 3) of which nothing is known but where they lie: a ray found each from no farther than
    twice its distance from the volume's centre."""
    return step_off(points, normals, normals, 2.0 * np.linalg.norm(points, axis=1))


def pull_back(points: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray:
    """Hit ``points`` (N, 3) moved back a little along their rays, unit ``directions`` (N, 3), so that they do not lie
    beyond the next wall where two meet."""
    magnitude = np.maximum(np.abs(points).max(axis=1), distances)
    return points - directions * (magnitude * _STEP)[:, None]


def traverse(
    hierarchy: Hierarchy,
    triangles: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    limits: np.ndarray | float = np.inf,
) -> tuple[Hits, TraversalCost]:
    """Nearest hits closer than ``limits`` through ``hierarchy``, built of ``triangles`` (T, 3, 3), with children
    entered nearest first; and the work done. Where nothing is hit the distance is the limit.

    Every ray takes one step (a node or a leaf) per round, on a stack of ``hierarchy.stack_size`` entries as in the
    shader. ``Hits.triangle`` counts as in ``triangles``, not in leaf order.
    """
    walk = _Walk(hierarchy, triangles, origins, directions, limits)
    active = np.arange(len(origins))
    while len(active):
        at_node = walk.item[active] >= 0
        walk.enter_nodes(active[at_node])
        walk.test_leaves(active[~at_node])
        active = walk.pop(active)
    return walk.hits, walk.cost


class _Walk:
    """Rays (N) on their way through a hierarchy: ``item`` (N,) is the node of each, or its leaf as −1−t."""

    def __init__(self, hierarchy: Hierarchy, triangles: np.ndarray, origins, directions, limits):
        count = len(origins)
        self._hierarchy = hierarchy
        self._corners = np.asarray(triangles, float)[hierarchy.order]
        self._boxes = hierarchy.nodes[:, : NODE_TEXELS - 1].reshape(-1, 2, 3, WIDTH).astype(float)
        self._children = hierarchy.nodes[:, NODE_TEXELS - 1].astype(np.int64)
        self._origins, self._directions = origins, directions
        with np.errstate(divide="ignore"):
            self._inverse = 1.0 / np.where(np.abs(directions) < 1e-20, 1e-20, directions)
        self.hits = Hits(np.broadcast_to(limits, count).astype(float), np.full(count, -1), np.zeros((count, 2)))
        self.cost = TraversalCost(*(np.zeros(count, np.int64) for _ in range(3)))
        self.item = np.zeros(count, np.int64)
        self._pending = np.zeros((count, hierarchy.stack_size), np.int64)
        self._entries = np.zeros((count, hierarchy.stack_size))
        self._top = np.zeros(count, np.int64)

    def enter_nodes(self, rays: np.ndarray) -> None:
        """Has ``rays`` (R,) note which children of their nodes they enter, the nearest last."""
        self.cost.nodes[rays] += 1
        node = self.item[rays]
        planes = (self._boxes[node] - self._origins[rays, None, :, None]) * self._inverse[rays, None, :, None]
        entry = np.maximum(planes.min(axis=1).max(axis=1), 0.0)
        leave = np.minimum(planes.max(axis=1).min(axis=1), self.hits.distance[rays, None]) * 1.00000024
        used = self._boxes[node, 0, 0] <= self._boxes[node, 1, 0]  # empty slots have inverted boxes
        entry = np.where((entry <= leave) & used, entry, np.inf)
        farthest_first = np.argsort(-entry, axis=1, kind="stable")
        for slot in farthest_first.T:
            distance = entry[np.arange(len(rays)), slot]
            entered = np.isfinite(distance)
            ray = rays[entered]
            self._pending[ray, self._top[ray]] = self._children[node[entered], slot[entered]]
            self._entries[ray, self._top[ray]] = distance[entered]
            self._top[ray] += 1
        self.cost.stack[rays] = np.maximum(self.cost.stack[rays], self._top[rays])

    def test_leaves(self, rays: np.ndarray) -> None:
        """Holds ``rays`` (R,) against the triangles of their leaves."""
        hits, index = self.hits, -1 - self.item[rays]
        while len(rays):
            self.cost.triangles[rays] += 1
            distance, barycentric = intersect(self._corners[index], self._origins[rays], self._directions[rays])
            nearer = distance < hits.distance[rays]
            hits.distance[rays[nearer]] = distance[nearer]
            hits.triangle[rays[nearer]] = self._hierarchy.order[index[nearer]]
            hits.barycentric[rays[nearer]] = barycentric[nearer]
            more = ~self._hierarchy.leaf_end[index]
            rays, index = rays[more], index[more] + 1

    def pop(self, rays: np.ndarray) -> np.ndarray:
        """Brings ``rays`` (R,) to the last thing noted that may still be nearer than their hit; returns those that have
        one."""
        found = []
        while len(rays):
            rays = rays[self._top[rays] > 0]
            self._top[rays] -= 1
            self.item[rays] = self._pending[rays, self._top[rays]]
            useful = self._entries[rays, self._top[rays]] <= self.hits.distance[rays]
            found.append(rays[useful])
            rays = rays[~useful]
        return np.concatenate(found)
