# SPDX-License-Identifier: GPL-3.0-or-later
"""Godot 4: a ``LightmapGIData`` resource as text, with the probes that light dynamic objects.

Godot looks a point up in a tree of planes, whose leaves are tetrahedra, and blends the light of four probes. Every cell
of the grid becomes six tetrahedra around its main diagonal (Kuhn 1960): a tetrahedron is the order in which a point's
three coordinates in the cell sort, so three comparisons find it. The tree first halves the grid between cells, then
compares.

A node is six 32-bit words: normal x, y, z and distance as float bits, then where to go for points over the plane
(n·p > d), then for the others; −(t + 1) is tetrahedron t. Children always come after their parent, as Godot demands.
Stored is radiance / π: Godot applies π times the cosine lobe's share and multiplies by albedo, not albedo / π.
"""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError
from .export_lattice import Lattice, thickened
from .export_numbers import listing

AXES, PRECISION, BANDS, SUFFIX = "y-up", "float", 3, ".tres"
ENGINE = "Godot 4.0 or later, LightmapGIData"
STORED = "radiance coefficients / pi, orthonormal; the shader applies the cosine lobe"
RUN_IN_ENGINE = False
DOES_NOT_CARRY = [
    "visibility weights: light leaks through walls thinner than a cell",
    "gradients of probes: between probes light is blended straight, coarser than in the preview",
    "trilinear interpolation: Godot blends four probes of a tetrahedron",
    "light per pixel: Godot looks the probes up once per object, at its centre; static meshes need lightmaps",
    "light outside the volume",
    "which probes are culled or invalid",
]
MOST_PROBES = 300_000  # 700 bytes of text each

# Tetrahedra of a cell by descending order of the coordinates, and the comparisons that tell them apart: at node n of
# the five, is coordinate a greater than b? Then go to the first, else to the second; tetrahedra are written −1 − t.
_ORDERS = ((0, 1, 2), (0, 2, 1), (2, 0, 1), (1, 0, 2), (1, 2, 0), (2, 1, 0))
_COMPARISONS = ((0, 1, 1, 3), (1, 2, -1, 2), (0, 2, -2, -3), (0, 2, -4, 4), (1, 2, -5, -6))


def write(job) -> dict:
    if job.lattice.grid.count > MOST_PROBES:
        raise InputError(
            f"{job.lattice.grid.count} probes are too many for Godot's text format, the limit is {MOST_PROBES}; "
            "bake fewer, or export exr-flipbook"
        )
    lattice = thickened(job.lattice)
    count = lattice.grid.count
    points = lattice.grid.positions().astype(np.float32)
    colors = np.zeros((count, 9, 4), np.float32)
    colors[:, : lattice.coefficients.shape[1], :3] = lattice.coefficients / np.pi
    colors[..., 3] = 1
    tree, tetrahedra = plane_tree(lattice), tetrahedron_nodes(lattice.grid.resolution)
    low, high = points.min(axis=0), points.max(axis=0)
    text = (
        '[gd_resource type="LightmapGIData" format=3]\n\n[resource]\nprobe_data = {\n'
        '"baked_exposure": 1.0,\n'
        f'"bounds": AABB({listing(np.concatenate([low, high - low]))}),\n'
        f'"bsp": PackedInt32Array({listing(tree)}),\n'
        '"interior": false,\n'
        f'"points": PackedVector3Array({listing(points)}),\n'
        f'"sh": PackedColorArray({listing(job.encode(colors))}),\n'
        f'"tetrahedra": PackedInt32Array({listing(tetrahedra)})\n'
        "}\n"
    )
    job.path(".tres").write_text(text, encoding="utf-8")
    return {
        "points": count,
        "tetrahedra": len(tetrahedra),
        "tree_nodes": len(tree),
        "frame": "the LightmapGI node's own; leave it at the origin unless the scene is moved with it",
    }


def tetrahedron_nodes(resolution: tuple[int, int, int]) -> np.ndarray:
    """(6·cells, 4) int32 nodes of the tetrahedra, cell by cell in flat order, in the order of ``_ORDERS``."""
    strides = np.array([1, resolution[0], resolution[0] * resolution[1]])
    steps = [np.concatenate([[0], np.cumsum(strides[list(order)])]) for order in _ORDERS]
    k, j, i = np.meshgrid(*(np.arange(count - 1) for count in resolution[::-1]), indexing="ij")
    first = np.stack([i.ravel(), j.ravel(), k.ravel()], axis=1) @ strides
    return (first[:, None, None] + np.array(steps)).reshape(-1, 4).astype(np.int32)


def plane_tree(lattice: Lattice) -> np.ndarray:
    """(nodes, 6) int32 words of the tree over all cells of ``lattice``, which has two nodes or more along each axis."""
    grid = lattice.grid
    to_lattice = grid.world_to_lattice()
    cells = np.array(grid.resolution) - 1
    low, high = np.zeros((1, 3), int), cells[None]
    planes, children = [], []  # per level, nodes in order
    first = 0  # number of this level's first node
    while len(low):
        size = high - low
        leaf = size.max(axis=1) == 1
        cost = np.where(leaf, len(_COMPARISONS), 1)
        start = first + np.cumsum(cost) - cost
        first += int(cost.sum())
        split = ~leaf
        axis = size[split].argmax(axis=1)
        rows = np.arange(len(axis))
        middle = (low[split, :][rows, axis] + high[split, :][rows, axis]) // 2
        upper_low, lower_high = low[split].copy(), high[split].copy()
        upper_low[rows, axis] = lower_high[rows, axis] = middle
        next_low = np.stack([upper_low, low[split]], axis=1).reshape(-1, 3)  # the upper half goes first
        next_high = np.stack([high[split], lower_high], axis=1).reshape(-1, 3)
        next_cost = np.where((next_high - next_low).max(axis=1) == 1, len(_COMPARISONS), 1)
        next_start = (first + np.cumsum(next_cost) - next_cost).reshape(-1, 2)
        plane, child = np.zeros((int(cost.sum()), 4)), np.zeros((int(cost.sum()), 2), int)
        at = start[split] - start[0] if len(start) else start
        plane[at] = _planes(to_lattice[axis], middle)
        child[at] = next_start
        _add_comparisons(plane, child, start[leaf], start[0], low[leaf], cells, to_lattice)
        planes.append(plane)
        children.append(child)
        low, high = next_low, next_high
    words = np.concatenate(planes).astype(np.float32).view(np.int32)
    return np.concatenate([words, np.concatenate(children).astype(np.int32)], axis=1)


def _planes(forms: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(N, 4) unit normal and distance of the planes where the linear ``forms`` (N, 4) take ``values`` (N,)."""
    length = np.linalg.norm(forms[:, :3], axis=1, keepdims=True)
    return np.concatenate([forms[:, :3], (values - forms[:, 3])[:, None]], axis=1) / length


def _add_comparisons(plane, child, start, first, cell, cells, to_lattice) -> None:
    """Fills in the five nodes each of the leaves at ``start`` (N,), whose cells are ``cell`` (N, 3)."""
    tetrahedron = 6 * (cell @ np.array([1, cells[0], cells[0] * cells[1]]))
    for number, (a, b, over, under) in enumerate(_COMPARISONS):
        at = start - first + number
        forms = np.broadcast_to(to_lattice[a] - to_lattice[b], (len(start), 4))
        plane[at] = _planes(forms, cell[:, a] - cell[:, b])
        for side, target in enumerate((over, under)):
            child[at, side] = start + target if target > 0 else target - tetrahedron
