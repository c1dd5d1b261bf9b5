# SPDX-License-Identifier: GPL-3.0-or-later
"""Where ``verify`` asks for the light: nodes, random free points and random surface points, none in or behind a wall.

That is decided as in the bake (``core.orientation``, ``core.relocation``), only that other eyes look: rays of Blender's
own tree, and Cycles says what is lit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.errors import InputError
from ..core.grid import Grid
from ..core.orientation import ShellVote
from ..core.panorama import panorama_coordinates
from ..core.relocation import misplaced
from ..core.snapshot import SceneSnapshot

SIX_NORMALS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)

Light = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(world points (N, 3), directions (S, 3)) -> (N, S) bool: light comes from there."""

_RAYS = 128  # that decide whether a point is inside a solid
_DOUBTFUL = 0.25  # of back faces or of sky in sight: up to here a point is in a room, whatever the light
_CLEARANCE = 0.02  # of a cell's shortest edge between a free point and the nearest surface
_LIFT = 2e-3  # of a cell's shortest edge between a surface point and its surface
_REACH = 0.5  # cells beyond the box in which surfaces that face it count: a volume seldom touches the walls it lights
_TRIES = 200  # candidates per point that is asked for
_LIGHT_HEIGHT, _LIGHT_SAMPLES = 16, 4  # of the panoramas that tell light from dark


def cycles_light(scene, frame: int | None = None) -> Light:
    """What Cycles sees lit in ``scene``: small panoramas, whose only message is black or not."""
    from ..scene.cycles_reference import render_panoramas

    def light(points, directions):
        width = 2 * _LIGHT_HEIGHT
        u, v = np.moveaxis(panorama_coordinates(directions), -1, 0)
        column = np.minimum((u * width).astype(int), width - 1)
        row = np.minimum((v * _LIGHT_HEIGHT).astype(int), _LIGHT_HEIGHT - 1)
        images = render_panoramas(scene, points, width, _LIGHT_HEIGHT, _LIGHT_SAMPLES, frame=frame)
        return images.any(axis=-1)[:, row, column]

    return light


class FreeSpace:
    """Tells free space from the inside of solids and from the void behind walls.

    Objects whose back faces are lit, such as a room made of a cube, are no solids; the first points that are asked for
    vote on it. Without ``light`` all back faces are the inside of something, and there is no void.
    """

    def __init__(self, snapshot: SceneSnapshot, light: Light | None = None):
        from mathutils.bvhtree import BVHTree

        self.snapshot = snapshot
        # Blender's tree is single precision: rays start from the middle of the scene, not from the world's origin.
        low, high = snapshot.bounds()
        self._origin = (low + high) / 2
        self._tree = BVHTree.FromPolygons(
            (snapshot.vertices - self._origin).tolist(), snapshot.triangles.tolist(), all_triangles=True
        )
        self._light = light
        self._shells: np.ndarray | None = None

    def is_free(self, points: np.ndarray, clearance_m: float = 0.0) -> np.ndarray:
        """(N,) bool for world ``points`` (N, 3). The first call decides which objects are shells."""
        seen = self._sightings(points)
        behind, background = seen < 0, seen == 0
        lit = self._lit(points, np.maximum(behind.mean(axis=1), background.mean(axis=1)) > _DOUBTFUL)
        if self._shells is None:
            self._shells = np.zeros(max(len(self.snapshot.object_names), 1), bool)
            if self._light is not None:
                vote = ShellVote(len(self._shells))
                vote.add(seen + 0.5 * lit * np.sign(seen))
                self._shells = vote.shells()
        solid = behind & ~self._shells[np.abs(seen) - 1]
        free = ~misplaced(np.stack([kind.mean(axis=1) for kind in (solid, background, lit, behind)], axis=1))
        if clearance_m > 0:
            near = [
                self._tree.find_nearest(point, clearance_m)[0] is not None for point in (points - self._origin).tolist()
            ]
            free &= ~np.array(near, bool)
        return free

    def see_each_other(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """(N,) bool: nothing stands between the points of each pair, (N, 3) and (N, 3)."""
        offset = second - first
        distance = np.linalg.norm(offset, axis=1)
        rays = zip((first - self._origin).tolist(), offset.tolist(), distance.tolist())
        return np.array(
            [length == 0 or self._tree.ray_cast(start, step, length)[2] is None for start, step, length in rays], bool
        )

    def _sightings(self, points: np.ndarray) -> np.ndarray:
        """(N, _RAYS) int: ±(object + 1) that each ray meets, negative from behind, 0 for the sky."""
        directions = _spiral(_RAYS)
        seen = np.zeros((len(points), _RAYS), np.int64)
        objects = self.snapshot.object_index
        for row, point in enumerate((points - self._origin).tolist()):
            for column, direction in enumerate(directions.tolist()):
                _, normal, triangle, _ = self._tree.ray_cast(point, direction)
                if triangle is not None:
                    front = sum(a * b for a, b in zip(normal, direction)) < 0  # type: ignore[call-overload]
                    seen[row, column] = (1 if front else -1) * (int(objects[triangle]) + 1)
        return seen

    def _lit(self, points: np.ndarray, doubtful: np.ndarray) -> np.ndarray:
        """(N, _RAYS) bool: what each ray meets sends light. Only ``doubtful`` (N,) points are asked about it."""
        lit = np.ones((len(points), _RAYS), bool)
        if self._light is not None and doubtful.any():
            lit[doubtful] = self._light(points[doubtful], _spiral(_RAYS))
        return lit


def free_points(space: FreeSpace, grid: Grid, count: int, seed: int) -> np.ndarray:
    """(count, 3) random free points, uniform in the box of ``grid``, world metres.

    Raises:
        InputError: the box has hardly any free space.
    """
    random = np.random.default_rng(seed)
    clearance = _CLEARANCE * float(grid.cell_size().min())
    found = np.empty((0, 3))
    for _ in range(_TRIES):
        local = random.uniform(-1, 1, (max(count, 64), 3))
        points = local @ grid.matrix[:3, :3].T + grid.matrix[:3, 3]
        found = np.concatenate([found, points[space.is_free(points, clearance)]])
        if len(found) >= count:
            return found[:count]
    raise InputError(f"{grid.name}: its box holds hardly any free space; move it out of solid geometry")


def surface_points(space: FreeSpace, grid: Grid, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Random points on the free side of surfaces in the box of ``grid``, uniform by area.

    Surfaces up to half a cell outside count where the box can see them: walls around a volume, but not their far side.

    Returns (points, normals), each (M, 3) with M ≤ count: fewer where little surface has a free side.
    """
    random = np.random.default_rng(seed)
    corners = space.snapshot.triangle_positions
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(cross, axis=1)
    to_box = np.linalg.inv(grid.matrix)
    reach = 1 + 2 * _REACH / np.maximum(np.array(grid.resolution) - 1, 1)
    lift = _LIFT * float(grid.cell_size().min())
    points, normals = np.empty((0, 3)), np.empty((0, 3))
    for _ in range(_TRIES):
        chosen = random.choice(len(area), max(count, 64), p=area / area.sum())
        u, v = random.uniform(size=(2, len(chosen), 1))
        u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
        at = corners[chosen, 0] * (1 - u - v) + corners[chosen, 1] * u + corners[chosen, 2] * v
        local = at @ to_box[:3, :3].T + to_box[:3, 3]
        near = (np.abs(local) <= reach).all(axis=1)
        normal = cross[chosen] / area[chosen][:, None]
        normal *= random.choice([-1.0, 1.0], (len(chosen), 1))  # both sides of open surfaces are lit
        at, normal, local = (at + lift * normal)[near], normal[near], local[near]
        if len(at):
            in_box = np.clip(local, -1, 1) @ grid.matrix[:3, :3].T + grid.matrix[:3, 3]
            reached = (np.abs(local) <= 1).all(axis=1) | space.see_each_other(at, in_box)
            at, normal = at[reached], normal[reached]
            free = space.is_free(at) if len(at) else np.zeros(0, bool)
            points, normals = np.concatenate([points, at[free]]), np.concatenate([normals, normal[free]])
        if len(points) >= count:
            break
    return points[:count], normals[:count]


def _spiral(count: int) -> np.ndarray:
    """(count, 3) unit directions spread evenly: a Fibonacci spiral (González, Mathematical Geosciences 42, 2010)."""
    index = np.arange(count) + 0.5
    z = 1 - 2 * index / count
    angle = np.pi * (3 - np.sqrt(5)) * index
    radius = np.sqrt(1 - z * z)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
