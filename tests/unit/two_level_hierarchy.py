# SPDX-License-Identifier: GPL-3.0-or-later
"""A hierarchy of hierarchies, measured against the flat one and not taken into the program: one per mesh in the mesh's
own space, and one over the boxes of its instances.

Memory then grows with meshes and not with instances, and an instance that moves costs one matrix and a new top. Rays
pay for it where instances overlap: each is entered and left on its own. ``docs/measurements.md`` has both sides.

A ray is carried into an instance by the inverse of its matrix with its direction not made unit length again, so that
distances mean the same on both levels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from gridlight.core import bvh, rays

INSTANCE_TEXELS = 3  # rows of the world-to-mesh matrix, as a GPU would keep them


@dataclass(frozen=True)
class Mesh:
    """``triangles`` (T, 3, 3) float32 in its own space and the ``matrices`` (I, 4, 4) that put it into the world."""

    triangles: np.ndarray
    matrices: np.ndarray


@dataclass(frozen=True)
class InstancedHierarchy:
    """``top`` holds the instances as if each were a triangle; ``bottom`` one hierarchy a mesh. N instances."""

    top: bvh.Hierarchy
    bottom: list[bvh.Hierarchy]
    meshes: list[Mesh]
    mesh_of: np.ndarray  # (N,) int
    to_mesh: np.ndarray  # (N, 3, 4) float64: mesh = M[:, :3] @ world + M[:, 3]
    first_triangle: np.ndarray  # (N,) of each instance, as if all were flattened in order of meshes and matrices

    @property
    def stack_size(self) -> int:
        """Most entries pending; one marks where an instance is left."""
        return self.top.stack_size + 1 + max(hierarchy.stack_size for hierarchy in self.bottom)

    @property
    def texels(self) -> int:
        """RGBA32F texels of nodes, corners and matrices."""
        return (
            hierarchy_texels(self.top) + sum(map(hierarchy_texels, self.bottom)) + INSTANCE_TEXELS * len(self.mesh_of)
        )


def hierarchy_texels(hierarchy: bvh.Hierarchy) -> int:
    """RGBA32F texels of a hierarchy's nodes and corners."""
    return len(hierarchy.nodes) * bvh.NODE_TEXELS + len(hierarchy.order) * bvh.TRIANGLE_TEXELS


def build(meshes: list[Mesh]) -> InstancedHierarchy:
    """Hierarchies of all ``meshes``, each with at least one triangle and one matrix that can be inverted."""
    bottom = [bvh.build(mesh.triangles) for mesh in meshes]
    boxes = np.concatenate([_instance_boxes(h, mesh.matrices) for h, mesh in zip(bottom, meshes)])
    counts = [len(mesh.matrices) for mesh in meshes]
    sizes = np.repeat([len(mesh.triangles) for mesh in meshes], counts)
    return InstancedHierarchy(
        top=bvh.build(boxes[:, [0, 1, 1]]),
        bottom=bottom,
        meshes=meshes,
        mesh_of=np.repeat(np.arange(len(meshes)), counts),
        to_mesh=np.linalg.inv(np.concatenate([mesh.matrices for mesh in meshes]))[:, :3],
        first_triangle=np.cumsum(sizes) - sizes,
    )


def _instance_boxes(hierarchy: bvh.Hierarchy, matrices: np.ndarray) -> np.ndarray:
    """(I, 2, 3) float32 world boxes of instances: around the turned boxes of the tree's first two levels, which is
    tighter than around its outermost one."""
    nodes = hierarchy.nodes[: hierarchy.levels[min(2, len(hierarchy.levels) - 1)]]
    child = nodes[:, bvh.NODE_TEXELS - 1]
    used = nodes[:, 0] <= nodes[:, 3]
    deepest = used & ((child < 0) | (child >= len(nodes)))
    node, slot = np.nonzero(deepest)
    low, high = nodes[node, 0:3, slot].astype(float), nodes[node, 3:6, slot].astype(float)
    which = np.array(list(np.ndindex(2, 2, 2)), bool)
    corners = np.where(which, high[:, None], low[:, None]).reshape(-1, 3)
    world = corners @ matrices[:, :3, :3].transpose(0, 2, 1) + matrices[:, None, :3, 3]
    low, high = world.min(axis=1).astype(np.float32), world.max(axis=1).astype(np.float32)
    return np.stack([np.nextafter(low, -np.inf), np.nextafter(high, np.inf)], axis=1, dtype=np.float32)


def traverse(
    scene: InstancedHierarchy, origins: np.ndarray, directions: np.ndarray
) -> tuple[rays.Hits, rays.TraversalCost, np.ndarray]:
    """Nearest hits of rays (R, 3), the work done on both levels, and how many instances each ray entered (R,).

    ``Hits.triangle`` counts as ``first_triangle`` does. Each ray takes what is nearest from its stack: a node of the
    top, or an instance, through which it is led to the end before it goes on.
    """
    count = len(origins)
    hits = rays.Hits(np.full(count, np.inf), np.full(count, -1), np.zeros((count, 2)))
    cost = rays.TraversalCost(*(np.zeros(count, np.int64) for _ in range(3)))
    entered = np.zeros(count, np.int64)
    boxes = scene.top.nodes[:, : bvh.NODE_TEXELS - 1].reshape(-1, 2, 3, bvh.WIDTH).astype(float)
    children = scene.top.nodes[:, bvh.NODE_TEXELS - 1].astype(np.int64)
    inverse = 1.0 / np.where(np.abs(directions) < 1e-20, 1e-20, directions)
    pending = [[(0.0, 0)] for _ in range(count)]
    waiting: dict[int, list[int]] = {}  # instance -> rays that enter it in this round
    active = list(range(count))
    while active:
        waiting.clear()
        for ray in active:
            while pending[ray]:
                distance, item = pending[ray].pop()
                if distance > hits.distance[ray]:
                    continue
                if item < 0:
                    waiting.setdefault(-1 - item, []).append(ray)
                    break
                cost.nodes[ray] += 1
                planes = (boxes[item] - origins[ray, :, None]) * inverse[ray, :, None]
                entry = np.maximum(planes.min(axis=0).max(axis=0), 0.0)
                leave = np.minimum(planes.max(axis=0).min(axis=0), hits.distance[ray]) * 1.00000024
                used = boxes[item, 0, 0] <= boxes[item, 1, 0]
                for slot in np.argsort(-entry):
                    if used[slot] and entry[slot] <= leave[slot]:
                        met = _stack_items(scene.top, int(children[item, slot]))
                        pending[ray] += [(entry[slot], below) for below in met]
        for instance, group in waiting.items():
            _enter(scene, instance, np.array(group), origins, directions, hits, cost)
            entered[group] += 1
        active = [ray for group in waiting.values() for ray in group]
    return hits, cost, entered


def _stack_items(top: bvh.Hierarchy, child: int) -> list[int]:
    """Stack items for a child of the top: the node itself, or −1 − instance for each instance of a leaf."""
    if child >= 0:
        return [child]
    first = -1 - child
    last = first + int(np.argmax(top.leaf_end[first:]))
    return [-1 - int(instance) for instance in top.order[first : last + 1]]


def _enter(scene: InstancedHierarchy, instance: int, group: np.ndarray, origins, directions, hits, cost) -> None:
    """Leads rays ``group`` through ``instance`` and takes over what is nearer."""
    mesh, matrix = scene.mesh_of[instance], scene.to_mesh[instance]
    found, work = rays.traverse(
        scene.bottom[mesh],
        scene.meshes[mesh].triangles,
        origins[group] @ matrix[:, :3].T + matrix[:, 3],
        directions[group] @ matrix[:, :3].T,
        hits.distance[group],
    )
    cost.nodes[group] += work.nodes
    cost.triangles[group] += work.triangles
    nearer = found.triangle >= 0
    hits.distance[group[nearer]] = found.distance[nearer]
    hits.triangle[group[nearer]] = scene.first_triangle[instance] + found.triangle[nearer]
    hits.barycentric[group[nearer]] = found.barycentric[nearer]
