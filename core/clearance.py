# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes keep a distance from surfaces.

A probe that touches a wall sees it edge-on: in the coarse map of its depth statistics the wall hides itself, and the
surface that the probe should serve best reads it least. A volume whose box ends exactly at the walls of its room has
all its outer probes there, half of them inside by rounding. Probes that nearly touch a surface are therefore moved
CLEARANCE cells away from it, before anything is captured. Others stay: light at a node is best known at the node.

A probe in front of its nearest surface moves straight away from it; one that lies on it to the side of the volume's
centre. One behind it stands either in a solid or in a room with its normals the wrong way round, which only light can
tell (core/orientation.py): it stays until the bake knows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cell_ranges import cells_of_boxes
from .grid import Grid
from .kept import Kept
from .snapshot import SceneSnapshot
from .triangles import bounds

CLEARANCE = 0.2  # cells, by the shortest edge
NEAR = 0.02  # cells: probes nearer than this to a surface are moved
_TOUCH = 1e-3  # cells: nearer than this a probe is on the surface, on neither side
_MOST_OFFSET = 0.5  # cells along each axis, in all
_STEPS = 4  # away from the nearest surface each: three meet in a corner
_PAIRS_AT_ONCE = 1 << 19


@dataclass(frozen=True)
class Obstacles:
    """T triangles that the probes of a grid keep clear of."""

    triangles: np.ndarray  # (T, 3, 3) world metres
    low: np.ndarray  # (T, 3) lattice coordinates of a box around each, somewhat larger where the grid is turned
    high: np.ndarray  # (T, 3)

    @classmethod
    def all_of(cls, grid: Grid, triangles: np.ndarray) -> Obstacles:
        """Every one of ``triangles`` (T, 3, 3)."""
        return cls(triangles, *_in_lattice(grid, *bounds(triangles)))

    @classmethod
    def of(cls, grid: Grid, snapshot: SceneSnapshot) -> Obstacles:
        """The triangles of objects larger than the clearance: dust, leaves and threads hide nothing from a probe beside
        them."""
        return _kept_obstacles(grid, snapshot.vertices, snapshot.triangles, snapshot.object_index)

    def within(self, low: np.ndarray, high: np.ndarray) -> Obstacles:
        """Those that reach into the box ``low`` .. ``high`` (3,) of the lattice."""
        return self._chosen(((self.high >= low) & (self.low <= high)).all(axis=1))

    def _chosen(self, which: np.ndarray) -> Obstacles:
        return Obstacles(self.triangles[which], self.low[which], self.high[which])


def _large_objects(grid: Grid, vertices: np.ndarray, vertices_of: np.ndarray, object_index: np.ndarray) -> Obstacles:
    """``Obstacles.of`` triangles ``vertices_of`` (T, 3), each of the object ``object_index`` (T,)."""
    triangles = vertices[vertices_of]
    low, high = bounds(triangles)
    starts = np.flatnonzero(np.diff(object_index, prepend=-1))  # of runs of triangles of one object
    lowest, highest = np.full((2, int(object_index.max(initial=0)) + 1, 3), [[[np.inf]], [[-np.inf]]])
    if len(starts):
        objects = object_index[starts]
        np.minimum.at(lowest, objects, np.minimum.reduceat(low, starts))
        np.maximum.at(highest, objects, np.maximum.reduceat(high, starts))
    large = np.linalg.norm(highest - lowest, axis=1) > CLEARANCE * grid.cell_size().min()
    found = Obstacles(triangles, *_in_lattice(grid, low, high))
    return found if large[object_index].all() else found._chosen(large[object_index])


_kept_obstacles = Kept(_large_objects, most_bytes=1 << 30)  # asked for several times in every bake


def _in_lattice(grid: Grid, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest (N, 3) lattice coordinates of the boxes ``low`` .. ``high`` (N, 3), world metres."""
    to_lattice = grid.world_to_lattice()
    centre = (low + high) @ (to_lattice[:, :3].T / 2) + to_lattice[:, 3]
    half = (high - low) @ (np.abs(to_lattice[:, :3]).T / 2)
    return centre - half, centre + half


def keep_clear(
    grid: Grid,
    nodes: np.ndarray,
    positions: np.ndarray,
    obstacles: Obstacles,
    also_behind: bool = False,
    near: float = NEAR,
) -> np.ndarray:
    """(L, 3) ``positions`` (L, 3) of the probes at grid ``nodes`` (L,), moved away from ``obstacles``; world metres.

    Args:
        near: cells; probes nearer than this to a surface move.
        also_behind: probes behind their nearest surface move too, away from it, because they are known to be in a room.
    """
    cell = float(grid.cell_size().min())
    near_ones = np.unique(_near_pairs(grid, nodes, positions, obstacles, near * cell)[0])  # few, as a rule
    moved = positions.copy()
    moved[near_ones] = _moved_away(grid, nodes[near_ones], positions[near_ones], obstacles, also_behind, near * cell)
    return moved


def _moved_away(
    grid: Grid, nodes: np.ndarray, positions: np.ndarray, obstacles: Obstacles, also_behind: bool, near: float
) -> np.ndarray:
    """``keep_clear`` for probes that may all be nearer than ``near`` metres to a surface."""
    clearance = CLEARANCE * float(grid.cell_size().min())
    touch = _TOUCH * float(grid.cell_size().min())
    # After a step away from one surface the next one counts.
    probe, triangle = _near_pairs(grid, nodes, positions, obstacles, 2 * clearance)
    corners = obstacles.triangles[triangle]
    edges = np.roll(corners, -1, axis=1) - corners
    normals = np.cross(edges[:, 0], edges[:, 1])
    doubled_area = np.linalg.norm(normals, axis=1)
    thick = doubled_area > touch * np.linalg.norm(edges, axis=2).max(axis=1)  # needles hide nothing either
    if not thick.any():
        return positions
    probe, corners, normals = probe[thick], corners[thick], normals[thick] / doubled_area[thick, None]
    moved = positions.copy()
    free = np.zeros(len(positions), bool)
    for step in range(_STEPS):
        offset = moved[probe] - nearest_points(corners, moved[probe])
        distance = np.linalg.norm(offset, axis=1)
        first = _nearest_of_each(probe, distance)
        at, length, normal = probe[first], distance[first], normals[first]
        inward = np.einsum("li,li->l", normal, grid.center - moved[at]) >= 0
        touches = length < touch
        away = np.where(
            touches[:, None],
            np.where(inward[:, None], normal, -normal),
            offset[first] / np.maximum(length, 1e-300)[:, None],
        )
        if step == 0:
            in_front = touches | (np.einsum("li,li->l", away, normal) > -1e-6)
            free[at] = (length < near) & (in_front | also_behind)
        moves = free[at] & (length < clearance)
        if not moves.any():
            break
        moved[at[moves]] += (away * (clearance - length)[:, None])[moves]
    return _where_better(grid, nodes, positions, moved, probe, corners, clearance)


def nearest_points(triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, 3) point of each of ``triangles`` (N, 3, 3) that is nearest to its point of ``points`` (N, 3).

    Ericson, "Real-Time Collision Detection", 2005, 5.1.5: by the region of the plane that the point projects to.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, ac = b - a, c - a
    d1, d2 = _dot(ab, points - a), _dot(ac, points - a)
    d3, d4 = _dot(ab, points - b), _dot(ac, points - b)
    d5, d6 = _dot(ab, points - c), _dot(ac, points - c)
    over_a, over_b, over_c = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    total = over_a + over_b + over_c
    nearest = a + _ratio(over_b, total)[:, None] * ab + _ratio(over_c, total)[:, None] * ac
    on_bc = b + _ratio(d4 - d3, (d4 - d3) + (d5 - d6))[:, None] * (c - b)
    on_ac = a + _ratio(d2, d2 - d6)[:, None] * ac
    on_ab = a + _ratio(d1, d1 - d3)[:, None] * ab
    for region, place in (
        ((over_a <= 0) & (d4 >= d3) & (d5 >= d6), on_bc),
        ((over_b <= 0) & (d2 >= 0) & (d6 <= 0), on_ac),
        ((over_c <= 0) & (d1 >= 0) & (d3 <= 0), on_ab),
        ((d6 >= 0) & (d5 <= d6), c),
        ((d3 >= 0) & (d4 <= d3), b),
        ((d1 <= 0) & (d2 <= 0), a),
    ):
        nearest = np.where(region[:, None], place, nearest)
    return nearest


def _where_better(
    grid: Grid, nodes: np.ndarray, before: np.ndarray, after: np.ndarray, probe, corners, clearance: float
) -> np.ndarray:
    """``after`` where that is within reach of its node, crossed no surface and is farther from them than ``before``."""
    moved = (after != before).any(axis=1)
    inverse = np.linalg.inv(grid.matrix)[:3, :3]
    spans = np.maximum(np.array(grid.resolution) - 1, 1) / 2.0
    in_cells = np.abs((after - grid.positions()[nodes]) @ inverse.T) * spans
    good = moved & (in_cells <= _MOST_OFFSET).all(axis=1)
    pair = np.flatnonzero(good[probe])
    at, triangle = probe[pair], corners[pair]
    room = np.full((2, len(before)), np.inf)
    for row, places in enumerate((before, after)):
        distance = np.linalg.norm(places[at] - nearest_points(triangle, places[at]), axis=1)
        np.minimum.at(room[row], at, distance)
    good &= room[1] > np.minimum(room[0], 0.999 * clearance)
    crossed = np.zeros(len(before), bool)
    touch = _TOUCH * float(grid.cell_size().min())
    np.logical_or.at(crossed, at, _crosses(before[at], after[at], triangle, touch))
    return np.where((good & ~crossed)[:, None], after, before)


def _crosses(start: np.ndarray, end: np.ndarray, triangles: np.ndarray, touch: float) -> np.ndarray:
    """(N,) bool: the way from ``start`` to ``end`` (N, 3) leads through its triangle, unless it starts on it."""
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    normal = np.cross(edge1, edge2)
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    height0, height1 = _dot(start - triangles[:, 0], normal) / size, _dot(end - triangles[:, 0], normal) / size
    through = (height0 * height1 < 0) & (np.abs(height0) > touch)
    share = _ratio(height0, height0 - height1)
    place = start + share[:, None] * (end - start)
    return through & (np.linalg.norm(place - nearest_points(triangles, place), axis=1) < touch)


def _near_pairs(
    grid: Grid, nodes: np.ndarray, positions: np.ndarray, obstacles: Obstacles, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Row of ``nodes`` and triangle of every pair that is nearer than ``reach`` metres."""
    row_of = np.full(grid.count, -1)
    row_of[nodes] = np.arange(len(nodes))
    offset = positions - grid.positions()[nodes]
    most = reach + float(np.sqrt((offset**2).sum(axis=1)).max(initial=0.0))
    margin = most * np.linalg.norm(grid.world_to_lattice()[:, :3], axis=1)
    resolution = np.array(grid.resolution)
    first = np.maximum(np.ceil(obstacles.low - margin), 0)
    last = np.minimum(np.floor(obstacles.high + margin), resolution - 1)
    near = np.flatnonzero((first <= last).all(axis=1))
    first, last = first[near].astype(np.int64), last[near].astype(np.int64)
    found = [(np.zeros(0, np.int64), np.zeros(0, np.int64))]
    for which, node in cells_of_boxes(first, last, _PAIRS_AT_ONCE):
        i, j, k = node.T
        row, triangle = row_of[i + resolution[0] * (j + resolution[1] * k)], near[which]
        row, triangle = row[row >= 0], triangle[row >= 0]
        place = positions[row]
        low, high = bounds(obstacles.triangles[triangle])
        close = ((low - place < reach) & (place - high < reach)).all(axis=1)
        row, triangle = row[close], triangle[close]
        apart = np.linalg.norm(positions[row] - nearest_points(obstacles.triangles[triangle], positions[row]), axis=1)
        found.append((row[apart < reach], triangle[apart < reach]))
    rows, near_triangles = zip(*found)
    return np.concatenate(rows), np.concatenate(near_triangles)


def _nearest_of_each(probe: np.ndarray, distance: np.ndarray) -> np.ndarray:
    """Index of the least ``distance`` among the entries of each value of ``probe``."""
    order = np.lexsort((distance, probe))
    return order[np.unique(probe[order], return_index=True)[1]]


def _dot(u: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.einsum("ni,ni->n", u, v)


def _ratio(numerator: np.ndarray, denominator: np.ndarray) -> np.ndarray:
    return np.where(denominator != 0, numerator / np.where(denominator != 0, denominator, 1.0), 0.0)
