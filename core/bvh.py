# SPDX-License-Identifier: GPL-3.0-or-later
"""Bounding volume hierarchy over triangles: built bottom-up, flattened to four-wide nodes for the GPU.

Building is PLOC (Meister and Bittner, "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction",
TVCG 2018): clusters in Morton order merge with the neighbour whose joint box has the least surface, which gives trees
as good as a full sweep of the surface area heuristic and is nothing but array operations. The binary tree is then
collapsed to four-wide nodes (Wald et al. 2008), the widest child first, so that a traversal step fetches one node and
tests four boxes.

Flat layout, one row of RGBA32F texels per node (``NODE_TEXELS``)::

    0 low x of children 0..3      3 high x                  6 child: n ≥ 0 inner node n,
    1 low y                       4 high y                           −1−t leaf that starts at triangle t
    2 low z                       5 high z

Empty slots have an inverted box and are never entered. Triangles are stored in leaf order, ``TRIANGLE_TEXELS`` texels
each: three corners, the first one's w is 1 where the leaf ends. Nodes are stored level by level from the root.

When triangles move and stay as many, the tree is kept and only its boxes are made anew (``refit``), which is cheaper.
What moved far or apart stretches boxes over what lies between; ``stretched`` tells when building again is better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .kept import Kept
from .triangles import bounds

NODE_TEXELS = 7
TRIANGLE_TEXELS = 3
WIDTH = 4
LEAF_SIZE = 2  # triangles; 1, 2, 4 and 8 are compared in docs/history.md
SEARCH_RADIUS = 8  # neighbours looked at on each side in Morton order
MOST_STRETCH = 1.3  # how much dearer rays may get before building again pays, see docs/measurements.md
_BLOCK = 1 << 14  # clusters per pass: keeps the working set in cache
_EMPTY = np.float32(3e38)


@dataclass(frozen=True)
class Hierarchy:
    """Flattened hierarchy. N nodes, T triangles.

    ``nodes`` is (N, NODE_TEXELS, 4) float32, ``order`` (T,) int64 maps leaf order to the caller's triangles,
    ``leaf_end`` (T,) bool marks the last triangle of each leaf, ``stack_size`` is the most entries that a traversal
    can have pending. ``levels`` (D + 1,) are the first nodes of each level, and N. ``cost`` is the surface-area cost of
    the tree: expected node and triangle tests of a random ray that enters it; ``extent`` half the surface of the box
    around it, so that cost · extent compares trees that fill different boxes.
    """

    nodes: np.ndarray
    order: np.ndarray
    leaf_end: np.ndarray
    stack_size: int
    levels: tuple[int, ...]
    cost: float
    extent: float


def build(triangles: np.ndarray) -> Hierarchy:
    """Builds the hierarchy of ``triangles`` (T, 3, 3) float32, T ≥ 1, in the frame that the rays will use."""
    triangles = np.asarray(triangles, np.float32)
    low, high = bounds(triangles)
    order = np.argsort(morton_codes((low + high) * np.float32(0.5)), kind="stable")
    tree = _merge(low[order].T.copy(), high[order].T.copy())
    return _flatten(tree, order)


kept_or_built = Kept(build)


def refit(
    hierarchy: Hierarchy, triangles: np.ndarray, changed: np.ndarray | None = None
) -> tuple[Hierarchy, np.ndarray]:
    """The same tree with boxes around ``triangles`` (T, 3, 3) float32, which count as when it was built.

    ``changed`` (T,) bool are those that may differ, all by default. Order, leaves and children stay as they were.
    Returns the tree and the nodes (K,), ascending, whose boxes were made anew: only they and the corners of changed
    triangles have to be sent again.
    """
    child = hierarchy.nodes[:, NODE_TEXELS - 1].astype(np.int64)
    used = hierarchy.nodes[:, 0] <= hierarchy.nodes[:, 3]
    leaf_slot = np.flatnonzero(used & (child < 0))
    parent_slot = np.concatenate([[0], np.flatnonzero(used & (child >= 0))])  # of each node: they are numbered so
    first = -1 - child.ravel()[leaf_slot]
    if changed is not None:
        run_starts = np.flatnonzero(np.concatenate([[True], hierarchy.leaf_end[:-1]]))
        in_run = np.zeros(len(hierarchy.order), bool)
        in_run[run_starts] = np.logical_or.reduceat(changed[hierarchy.order], run_starts)
        leaf_slot, first = leaf_slot[in_run[first]], first[in_run[first]]
    nodes = hierarchy.nodes.copy()
    low, high = _leaf_boxes(np.asarray(triangles, np.float32), hierarchy, first)
    nodes[leaf_slot // WIDTH, 0:3, leaf_slot % WIDTH] = low
    nodes[leaf_slot // WIDTH, 3:6, leaf_slot % WIDTH] = high
    fresh = np.zeros(len(nodes), bool)
    fresh[leaf_slot // WIDTH] = True
    for start, stop in reversed(list(zip(hierarchy.levels[1:], hierarchy.levels[2:]))):
        node = start + np.flatnonzero(fresh[start:stop])
        boxes, parent = nodes[node], parent_slot[node]  # empty slots are inverted and take no part in a minimum
        nodes[parent // WIDTH, 0:3, parent % WIDTH] = _fold(np.minimum, boxes[:, 0:3].transpose(2, 0, 1))
        nodes[parent // WIDTH, 3:6, parent % WIDTH] = _fold(np.maximum, boxes[:, 3:6].transpose(2, 0, 1))
        fresh[parent // WIDTH] = True
    fresh = np.flatnonzero(fresh)
    before, after = (_weighted_surface(rows[fresh], hierarchy.leaf_end) for rows in (hierarchy.nodes, nodes))
    extent = _extent(nodes)
    surface = (hierarchy.cost - 1.0) * hierarchy.extent + after - before
    return replace(hierarchy, nodes=nodes, cost=1.0 + surface / max(extent, 1e-300), extent=extent), fresh


def _leaf_boxes(triangles: np.ndarray, hierarchy: Hierarchy, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Low and high corners (K, 3) of the leaves that start at ``first`` (K,)."""
    corners = triangles[hierarchy.order[first]]
    low, high = _fold(np.minimum, corners.transpose(1, 0, 2)), _fold(np.maximum, corners.transpose(1, 0, 2))
    open_ = np.flatnonzero(~hierarchy.leaf_end[first])
    index = first[open_]
    while len(open_):
        index = index + 1
        corners = triangles[hierarchy.order[index]]
        low[open_] = np.minimum(low[open_], _fold(np.minimum, corners.transpose(1, 0, 2)))
        high[open_] = np.maximum(high[open_], _fold(np.maximum, corners.transpose(1, 0, 2)))
        more = ~hierarchy.leaf_end[index]
        open_, index = open_[more], index[more]
    return low, high


def _fold(function: np.ufunc, parts: np.ndarray) -> np.ndarray:
    """``function`` over the short first axis; numpy's own reduction is slow over a few elements."""
    result = function(parts[0], parts[1])
    for part in parts[2:]:
        function(result, part, out=result)
    return result


def stretched(refitted: Hierarchy, built: Hierarchy) -> bool:
    """Has refitting made rays so much dearer than when the tree was ``built`` that it should be built again?"""
    return refitted.cost * refitted.extent > MOST_STRETCH * built.cost * built.extent


def _weighted_surface(nodes: np.ndarray, leaf_end: np.ndarray) -> float:
    """Sum over the children of ``nodes`` (K, …) of half their surface, for leaves times their triangles."""
    low, high, child = nodes[:, 0:3], nodes[:, 3:6], nodes[:, NODE_TEXELS - 1]
    node, slot = np.nonzero(low[:, 0] <= high[:, 0])
    area = _half_area(low[node, :, slot].T, high[node, :, slot].T)
    last = -1 - child[node, slot].astype(np.int64)
    total = float(area.sum())
    area, last = area[last >= 0], last[last >= 0]
    while len(last):  # once more for every further triangle of a leaf
        more = ~leaf_end[last]
        area, last = area[more], last[more] + 1
        total += float(area.sum())
    return total


def _extent(nodes: np.ndarray) -> float:
    """Half the surface of the box around the root's children."""
    return float(_half_area(nodes[0, 0:3].min(axis=1), nodes[0, 3:6].max(axis=1)))


@dataclass
class _BinaryTree:
    """Nodes 0..T−1 are triangles in Morton order, the rest inner nodes; children come before their parents."""

    low: np.ndarray  # (3, M) float32
    high: np.ndarray
    left: np.ndarray  # (M,) int64, −1 for leaves
    right: np.ndarray
    batches: list[tuple[int, int]]  # index ranges of inner nodes made together; nodes of one batch are independent


def morton_codes(points: np.ndarray) -> np.ndarray:
    """(T,) uint64 codes of ``points`` (T, 3), 21 bits an axis over a cube around them all."""
    low = points.min(axis=0)
    extent = float((points.max(axis=0) - low).max()) or 1.0
    cells = ((points - low) * (2097151.0 / extent)).astype(np.uint64)
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        cells = (cells | (cells << np.uint64(shift))) & np.uint64(mask)
    return cells[:, 0] | (cells[:, 1] << np.uint64(1)) | (cells[:, 2] << np.uint64(2))


def _merge(low: np.ndarray, high: np.ndarray) -> _BinaryTree:
    """Merges clusters pairwise until one is left. ``low``, ``high``: (3, T) boxes in Morton order."""
    count = low.shape[1]
    tree = _BinaryTree(
        np.empty((3, 2 * count - 1), np.float32),
        np.empty((3, 2 * count - 1), np.float32),
        np.full(2 * count - 1, -1, np.int64),
        np.full(2 * count - 1, -1, np.int64),
        [],
    )
    tree.low[:, :count], tree.high[:, :count] = low, high
    nodes = np.arange(count)
    made = count
    while len(nodes) > 1:
        partner = _best_partner(low, high)
        index = np.arange(len(nodes))
        first = np.flatnonzero((partner[partner] == index) & (index < partner))
        second = partner[first]
        fresh = slice(made, made + len(first))
        tree.left[fresh], tree.right[fresh] = nodes[first], nodes[second]
        low[:, first] = np.minimum(low[:, first], low[:, second])
        high[:, first] = np.maximum(high[:, first], high[:, second])
        tree.low[:, fresh], tree.high[:, fresh] = low[:, first], high[:, first]
        tree.batches.append((made, made + len(first)))
        nodes[first] = np.arange(made, made + len(first))
        made += len(first)
        keep = np.ones(len(nodes), bool)
        keep[second] = False
        nodes, low, high = nodes[keep], low[:, keep], high[:, keep]
    return tree


def _best_partner(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(C,) index of the neighbour with which each cluster's joint box has the least surface.

    Cost and neighbour are packed in one integer, cost first (positive floats order like their bits), then index XOR
    neighbour: equal costs pair up even with odd instead of chasing each other along a row.
    """
    count = low.shape[1]
    best = np.full(count, np.iinfo(np.uint64).max, np.uint64)
    index = np.arange(count, dtype=np.uint64)
    for distance in range(1, min(SEARCH_RADIUS, count - 1) + 1):
        for start in range(0, count - distance, _BLOCK):
            stop = min(start + _BLOCK, count - distance)
            here, there = slice(start, stop), slice(start + distance, stop + distance)
            size = np.maximum(high[:, here], high[:, there])
            size -= np.minimum(low[:, here], low[:, there])
            area = size[0] * size[1]
            area += (size[0] + size[1]) * size[2]
            key = area.view(np.uint32).astype(np.uint64) << np.uint64(32)
            key |= index[here] ^ index[there]
            np.minimum(best[here], key, out=best[here])
            np.minimum(best[there], key, out=best[there])
    return ((best & np.uint64(0xFFFFFFFF)) ^ index).astype(np.int64)


def _half_area(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Half the surface of boxes (3, …)."""
    x, y, z = np.maximum(high.astype(np.float64) - low, 0.0)
    return x * y + (x + y) * z


def _flatten(tree: _BinaryTree, order: np.ndarray) -> Hierarchy:
    """Collapses the binary tree to four-wide nodes and puts the triangles in leaf order."""
    count = len(order)
    total = len(tree.left)
    size = np.ones(total, np.int64)
    for start, stop in tree.batches:
        size[start:stop] = size[tree.left[start:stop]] + size[tree.right[start:stop]]
    first = np.zeros(total, np.int64)
    for start, stop in reversed(tree.batches):
        first[tree.left[start:stop]] = first[start:stop]
        first[tree.right[start:stop]] = first[start:stop] + size[tree.left[start:stop]]
    leaf_order = np.empty(count, np.int64)
    leaf_order[first[:count]] = order

    inner = size > LEAF_SIZE
    area = _half_area(tree.low, tree.high)
    levels = []
    frontier = np.array([total - 1])
    pending = np.array([0])  # stack entries that wait while a node of the frontier is visited
    stack_size, made = 1, 1
    while len(frontier):
        children = np.full((len(frontier), WIDTH), -1, np.int64)
        if inner[frontier[0]]:
            children[:, 0], children[:, 1] = tree.left[frontier], tree.right[frontier]
        else:  # the root itself is a leaf: a scene of one or two triangles
            children[:, 0] = frontier
        for slot in range(2, WIDTH):
            gain = np.where((children >= 0) & inner[children], area[children], -1.0)
            widest = gain.argmax(axis=1)
            opened = np.flatnonzero(gain[np.arange(len(frontier)), widest] >= 0)
            chosen = children[opened, widest[opened]]
            children[opened, widest[opened]] = tree.left[chosen]
            children[opened, slot] = tree.right[chosen]
        goes_on = (children >= 0) & inner[children]
        numbers = np.full(children.shape, -1, np.int64)
        numbers[goes_on] = made + np.arange(goes_on.sum())
        levels.append((children, numbers))
        used = (children >= 0).sum(axis=1)
        stack_size = max(stack_size, int((pending + used).max()))
        pending = np.broadcast_to((pending + used - 1)[:, None], children.shape)[goes_on]
        made += int(goes_on.sum())
        frontier = children[goes_on]

    starts = np.cumsum([0, *(len(c) for c, _ in levels)])
    children = np.concatenate([c for c, _ in levels])
    numbers = np.concatenate([n for _, n in levels])
    is_used = children >= 0
    nodes = np.zeros((len(children), NODE_TEXELS, WIDTH), np.float32)
    nodes[:, 0:3] = np.where(is_used[:, None, :], tree.low[:, children].transpose(1, 0, 2), _EMPTY)
    nodes[:, 3:6] = np.where(is_used[:, None, :], tree.high[:, children].transpose(1, 0, 2), -_EMPTY)
    nodes[:, 6] = np.where(numbers >= 0, numbers, -1 - first[children])

    leaves = children[is_used & (numbers < 0)]
    leaf_end = np.zeros(count, bool)
    leaf_end[first[leaves] + size[leaves] - 1] = True
    extent = _extent(nodes)
    cost = 1.0 + _weighted_surface(nodes, leaf_end) / max(extent, 1e-300)
    return Hierarchy(nodes, leaf_order, leaf_end, stack_size, tuple(starts.tolist()), cost, extent)
