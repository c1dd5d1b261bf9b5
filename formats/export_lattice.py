# SPDX-License-Identifier: GPL-3.0-or-later
"""Probes on their way to an engine: another space, other axes, only what the target can take.

A ``Lattice`` is a field without what no engine reads; its gradients are kept for resampling alone. Engines want its box
along their axes (three.js), turned but not mirrored (Bevy), or take any positions (Godot, Unity); ``axis_aligned``,
``right_handed`` and ``thickened`` bring it there. All of them keep light where it is: they reorder nodes, or resample
where reordering cannot do it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from ..core.conventions import bands_of
from ..core.errors import InputError
from ..core.field import Field
from ..core.gradients import per_cell
from ..core.grid import Grid
from ..core.lookup import gradient_steps, trilinear
from ..core.settings import MAX_RESOLUTION
from ..core.sh_rotation import rotate

# Rows: the target's X, Y, Z in Blender's coordinates.
AXES = {
    "blender": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "y-up": ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "unity": ((-1, 0, 0), (0, 0, 1), (0, -1, 0)),
    "unreal": ((1, 0, 0), (0, -1, 0), (0, 0, 1)),
}
_ALIGNED = 1e-6  # of a unit axis: less tilt than this is rounding of a matrix


@dataclass(frozen=True)
class Lattice:
    """Light at the nodes of ``grid``, in the target's space and axes. P = ``grid.count``, flat node order."""

    grid: Grid
    coefficients: np.ndarray  # (P, bands², 3) float32 radiance
    state: np.ndarray  # (P,) uint8
    steps: np.ndarray | None = None  # (P, 3, K, 3) change over a cell along the grid's axes; none after resampling

    @property
    def bands(self) -> int:
        return bands_of(self.coefficients.shape[1])


@dataclass(frozen=True)
class Resampling:
    """What it cost to bring a rotated volume onto straight axes."""

    resolution: tuple[int, int, int]
    relative_rms: float  # of radiance coefficients, looked up before and trilinear after, inside the volume


def axes_matrix(name: str) -> np.ndarray:
    """(3, 3) matrix from Blender's axes to those called ``name``: one of ``AXES``, or three of ±x, ±y, ±z by comma.

    Raises:
        InputError: neither.
    """
    if name in AXES:
        return np.array(AXES[name], float)
    rows = []
    for word in name.lower().split(","):
        sign = -1.0 if word.strip().startswith("-") else 1.0
        letter = word.strip().lstrip("+-")
        if letter in ("x", "y", "z"):
            rows.append(sign * np.eye(3)["xyz".index(letter)])
    if len(rows) != 3 or len(name.split(",")) != 3 or not np.linalg.det(rows):
        raise InputError(f"--axes {name}: name {', '.join(AXES)}, or give the target's X,Y,Z like x,z,-y")
    return np.array(rows)


def converted(field: Field, axes: np.ndarray, scale: float) -> Lattice:
    """``field`` in the target's axes ((3, 3), see ``axes_matrix``), its lengths times ``scale``."""
    matrix = np.asarray(field.grid.matrix, float).copy()
    matrix[:3] = scale * (axes @ matrix[:3])
    grid = Grid(matrix, field.grid.resolution, field.grid.name)
    turned = not np.array_equal(axes, np.eye(3))
    coefficients, steps = field.coefficients, per_cell(field.grid, field.gradient)
    if turned:
        coefficients = rotate(coefficients, axes)
        steps = rotate(steps, axes)
    return Lattice(grid, coefficients.astype(np.float32), field.state, steps)


def reordered(lattice: Lattice, order: tuple[int, int, int], flips: tuple[bool, bool, bool]) -> Lattice:
    """The same nodes counted along other axes of the box: new axis a is old axis ``order[a]``, backwards where
    ``flips[a]``."""
    signs = np.where(flips, -1.0, 1.0)
    matrix = lattice.grid.matrix.copy()
    matrix[:3, :3] = matrix[:3, list(order)] * signs
    nx, ny, nz = (lattice.grid.resolution[axis] for axis in order)
    nodes = np.arange(lattice.grid.count).reshape(lattice.grid.resolution[::-1])  # [k, j, i]
    nodes = nodes.transpose([2 - order[axis] for axis in (2, 1, 0)])
    nodes = nodes[tuple(slice(None, None, -1 if flips[axis] else 1) for axis in (2, 1, 0))].ravel()
    grid = Grid(matrix, (nx, ny, nz), lattice.grid.name)
    steps = None if lattice.steps is None else lattice.steps[nodes][:, list(order)] * signs[:, None, None]
    return Lattice(grid, lattice.coefficients[nodes], lattice.state[nodes], steps)


def nearest_axes(lattice: Lattice) -> Lattice:
    """The nodes counted along those axes of the box that lie closest to the target's X, Y and Z, in their sense."""
    axes = lattice.grid.matrix[:3, :3] / np.linalg.norm(lattice.grid.matrix[:3, :3], axis=0)
    x, y, z = max(itertools.permutations(range(3)), key=lambda order: sum(abs(axes[a, order[a]]) for a in range(3)))
    return reordered(lattice, (x, y, z), (bool(axes[0, x] < 0), bool(axes[1, y] < 0), bool(axes[2, z] < 0)))


def right_handed(lattice: Lattice) -> Lattice:
    """The nodes counted so that the box is a turned one and not a mirror image, as close to the axes as that allows."""
    near = nearest_axes(lattice)
    return near if np.linalg.det(near.grid.matrix[:3, :3]) > 0 else reordered(near, (0, 1, 2), (True, False, False))


def is_aligned(lattice: Lattice) -> bool:
    """Does the box lie along the target's axes, in their order and sense?"""
    axes = lattice.grid.matrix[:3, :3] / np.linalg.norm(lattice.grid.matrix[:3, :3], axis=0)
    return bool(np.abs(axes - np.eye(3)).max() < _ALIGNED)


def is_sheared(lattice: Lattice) -> bool:
    """Are the box's edges anything but perpendicular?"""
    axes = lattice.grid.matrix[:3, :3] / np.linalg.norm(lattice.grid.matrix[:3, :3], axis=0)
    return bool(np.abs(axes.T @ axes - np.eye(3)).max() > _ALIGNED)


def axis_aligned(lattice: Lattice, refine: int = 1) -> tuple[Lattice, Resampling | None]:
    """``lattice`` with its box along the target's axes: reordered where it lies along them, else resampled.

    The resampled box is the smallest that holds all nodes. A step along any of its axes crosses at most one cell of the
    old grid, so no node's light is lost. With ``refine`` N cells are cut into N³, and the box grows so that it holds
    half an old cell around the outermost nodes still. Light between the old nodes is what a lookup finds there, but for
    walls: gradients count.

    Raises:
        InputError: that needs too many nodes along an axis.
    """
    near = nearest_axes(lattice)
    straight = is_aligned(near)
    if straight and refine == 1:
        return near, None
    old = near.grid
    positions = old.positions()
    low, high = positions.min(axis=0), positions.max(axis=0)
    if straight:
        steps = np.array(old.resolution) - 1
    else:
        slope = np.abs(old.world_to_lattice()[:, :3]).max(axis=0)
        steps = np.ceil((high - low) * slope - 1e-9).astype(int)
    thin = steps == 0
    half = np.where(thin, np.abs(old.matrix[:3, :3]).sum(axis=1), (high - low) / 2)
    border = np.where(thin, 0, -(-(refine - 1) // 2))
    half = half * (1 + 2 * border / np.where(thin, 1, steps * refine))
    grid = Grid.from_bounds(old.center - half, old.center + half, _counted(old, steps * refine + 1 + 2 * border))
    nodes, weights = trilinear(old, grid.positions())
    strongest = nodes[np.arange(grid.count), weights.argmax(axis=1)]
    result = Lattice(grid, _looked_up(near, grid.positions()), near.state[strongest])
    return result, None if straight else Resampling(grid.resolution, _difference(near, result))


def _counted(old: Grid, counts: np.ndarray) -> np.ndarray:
    if counts.max() > MAX_RESOLUTION:
        raise InputError(
            f"{old.name}: laid straight and refined it needs {counts.max()} probes along one axis, more than "
            f"{MAX_RESOLUTION}; use a lower --refine, or bake a volume along the world's axes"
        )
    return counts


def _looked_up(lattice: Lattice, points: np.ndarray) -> np.ndarray:
    """(N, K, 3) float32 coefficients of ``lattice`` at ``points`` (N, 3) in its space."""
    nodes, weights = trilinear(lattice.grid, points)
    steps = gradient_steps(lattice.grid, points, weights) * weights[..., None]
    result = np.zeros((len(nodes), *lattice.coefficients.shape[1:]), np.float32)
    for corner in range(nodes.shape[1]):
        node = nodes[:, corner]
        result += lattice.coefficients[node] * weights[:, corner, None, None].astype(np.float32)
        if lattice.steps is not None:
            led = np.einsum("na,nakc->nkc", steps[:, corner], lattice.steps[node])
            result[:, : led.shape[1]] += led.astype(np.float32)
    return result


def thickened(lattice: Lattice) -> Lattice:
    """``lattice`` with at least two nodes along every axis: a single one is doubled, at both faces of the box."""
    for axis, count in enumerate(lattice.grid.resolution):
        if count == 1:
            nx, ny, nz = (2 if a == axis else n for a, n in enumerate(lattice.grid.resolution))
            nodes = np.arange(lattice.grid.count).reshape(lattice.grid.resolution[::-1])
            nodes = np.repeat(nodes, 2, axis=2 - axis).ravel()
            grid = replace(lattice.grid, resolution=(nx, ny, nz))
            steps = None if lattice.steps is None else lattice.steps[nodes]
            lattice = Lattice(grid, lattice.coefficients[nodes], lattice.state[nodes], steps)
    return lattice


def cell_box(grid: Grid) -> np.ndarray:
    """(4, 4) matrix −1..1 to world of the box that holds one cell around every node: half a cell more on each side.

    Along an axis with one node it is the grid's own box."""
    counts = np.array(grid.resolution)
    matrix = grid.matrix.copy()
    matrix[:3, :3] *= np.where(counts > 1, counts / np.maximum(counts - 1, 1), 1.0)
    return matrix


def _difference(before: Lattice, after: Lattice) -> float:
    """Relative RMS of the coefficients between the two at 4096 places in the box of ``before``."""
    places = np.random.default_rng(0).uniform(-1, 1, (4096, 3))
    counts = np.array(before.grid.resolution)
    places *= counts > 1  # along an axis with one node the light is the same everywhere
    points = places @ before.grid.matrix[:3, :3].T + before.grid.matrix[:3, 3]
    first, second = _looked_up(before, points), _looked_up(after, points)
    scale = float(np.sqrt(np.mean(first**2)))
    return float(np.sqrt(np.mean((first - second) ** 2))) / scale if scale else 0.0
