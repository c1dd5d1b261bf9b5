# SPDX-License-Identifier: GPL-3.0-or-later
"""The hierarchy: complete, tight, within its stack, and with the same answers as testing every triangle."""

import time

import numpy as np
import pytest
from gridlight.core import bvh, rays


def random_triangles(count, seed=0, size=0.1):
    generator = np.random.default_rng(seed)
    return (generator.uniform(-1, 1, (count, 1, 3)) + generator.normal(0, size, (count, 3, 3))).astype(np.float32)


def random_rays(count, seed=1):
    generator = np.random.default_rng(seed)
    directions = generator.normal(size=(count, 3))
    return generator.uniform(-1.5, 1.5, (count, 3)), directions / np.linalg.norm(directions, axis=1, keepdims=True)


def grid_mesh(cells):
    """A flat square of 2·cells² equal triangles."""
    x, y = np.meshgrid(np.arange(cells), np.arange(cells))
    corner = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)[:, None].astype(np.float32)
    return np.concatenate(
        [corner + np.float32([[0, 0, 0], [1, 0, 0], [1, 1, 0]]), corner + np.float32([[0, 0, 0], [1, 1, 0], [0, 1, 0]])]
    )


SCENES = {
    "one": random_triangles(1),
    "two": random_triangles(2),
    "three": random_triangles(3),
    "five": random_triangles(5),
    "random": random_triangles(3000),
    "large and small": np.concatenate([random_triangles(500, 2, 0.01), random_triangles(20, 3, 3.0)]),
    "flat mesh": grid_mesh(30),
    "coincident": np.tile(random_triangles(1), (500, 1, 1)),
    "points": np.repeat(random_triangles(200)[:, :1], 3, axis=1),
    "far away": random_triangles(500) + np.float32(1000),
}


@pytest.fixture(params=SCENES, scope="module")
def triangles(request):
    return SCENES[request.param]


def leaves(hierarchy):
    """[(node, slot, first, stop)] of every leaf, found by walking from the root; also checks the walk is a tree."""
    found, visited = [], set()
    pending = [0]
    while pending:
        node = pending.pop()
        assert node not in visited
        visited.add(node)
        low, high = hierarchy.nodes[node, 0], hierarchy.nodes[node, 3]
        for slot in range(bvh.WIDTH):
            if low[slot] > high[slot]:
                continue
            child = int(hierarchy.nodes[node, 6, slot])
            if child >= 0:
                pending.append(child)
            else:
                first = -1 - child
                found.append((node, slot, first, first + int(np.argmax(hierarchy.leaf_end[first:])) + 1))
    assert len(visited) == len(hierarchy.nodes)
    return found


def test_every_triangle_is_in_exactly_one_leaf(triangles):
    hierarchy = bvh.build(triangles)
    np.testing.assert_array_equal(np.sort(hierarchy.order), np.arange(len(triangles)))
    ranges = sorted((first, stop) for _node, _slot, first, stop in leaves(hierarchy))
    assert ranges[0][0] == 0 and ranges[-1][1] == len(triangles)
    assert all(a[1] == b[0] for a, b in zip(ranges, ranges[1:]))
    assert max(stop - first for first, stop in ranges) <= bvh.LEAF_SIZE


def test_boxes_contain_what_is_below_them(triangles):
    hierarchy = bvh.build(triangles)
    boxes = hierarchy.nodes[:, :6].reshape(-1, 2, 3, bvh.WIDTH)
    for node, slot, first, stop in leaves(hierarchy):
        corners = triangles[hierarchy.order[first:stop]].reshape(-1, 3)
        assert (boxes[node, 0, :, slot] == corners.min(axis=0)).all() and (
            boxes[node, 1, :, slot] == corners.max(axis=0)
        ).all()
    for node in range(len(boxes)):
        for slot in range(bvh.WIDTH):
            child = int(hierarchy.nodes[node, 6, slot])
            used = boxes[node, 0, 0, slot] <= boxes[node, 1, 0, slot]
            if used and child >= 0:
                inner = boxes[child][:, :, boxes[child, 0, 0] <= boxes[child, 1, 0]]
                assert (inner[0].min(axis=1) == boxes[node, 0, :, slot]).all()
                assert (inner[1].max(axis=1) == boxes[node, 1, :, slot]).all()


def test_stack_bound_holds_for_any_traversal(triangles):
    """Worst case: every box is entered, and the deepest branch last pushed is taken first."""
    hierarchy = bvh.build(triangles)
    used = hierarchy.nodes[:, 0] <= hierarchy.nodes[:, 3]
    worst = 0
    pending = [(0, 0)]
    while pending:
        node, waiting = pending.pop()
        filled = waiting + int(used[node].sum())
        worst = max(worst, filled)
        pending += [(int(child), filled - 1) for child in hierarchy.nodes[node, 6][used[node]] if child >= 0]
    assert worst <= hierarchy.stack_size <= 64


def test_traversal_finds_what_brute_force_finds(triangles):
    origins, directions = random_rays(2000)
    origins = origins + triangles.reshape(-1, 3).mean(axis=0)
    hierarchy = bvh.build(triangles)
    found, cost = rays.traverse(hierarchy, triangles, origins, directions)
    expected = rays.closest_hit(triangles.astype(float), origins, directions)
    assert (found.distance == expected.distance).all()
    same = found.triangle == expected.triangle
    coincident = len(np.unique(triangles.reshape(len(triangles), -1), axis=0)) < len(triangles)
    assert same.all() or coincident
    assert (cost.nodes >= 1).all() and cost.stack.max() <= hierarchy.stack_size


def test_axis_parallel_rays_and_rays_in_the_plane_of_a_box():
    mesh = grid_mesh(16)
    hierarchy = bvh.build(mesh)
    origins = np.array([[x + 0.25, y + 0.5, 3] for x in range(16) for y in range(16)], float)
    down = np.tile([0, 0, -1.0], (len(origins), 1))
    found, _cost = rays.traverse(hierarchy, mesh, origins, down)
    np.testing.assert_allclose(found.distance, 3)


def test_the_tree_is_worth_its_name():
    """Against 20 000 random triangles a ray looks at some dozen nodes, not at hundreds."""
    triangles = random_triangles(20_000, size=0.02)
    origins, directions = random_rays(1000)
    _hits, cost = rays.traverse(bvh.build(triangles), triangles, origins, directions)
    assert cost.nodes.mean() < 40 and cost.triangles.mean() < 40


def test_the_hierarchy_of_the_last_triangles_is_kept():
    bvh.kept_or_built.forget()
    first = random_triangles(300)
    built = bvh.kept_or_built(first)
    assert bvh.kept_or_built(first.copy()) is built
    moved = first.copy()
    moved[7, 1, 2] += np.float32(1e-3)
    np.testing.assert_array_equal(bvh.kept_or_built(moved).nodes, bvh.build(moved).nodes)


def test_a_hundred_thousand_coincident_triangles():
    triangles = np.tile(random_triangles(1), (100_000, 1, 1))
    start = time.perf_counter()
    hierarchy = bvh.build(triangles)
    assert time.perf_counter() - start < 10
    assert hierarchy.stack_size <= 64
    np.testing.assert_array_equal(np.sort(hierarchy.order), np.arange(100_000))


@pytest.mark.nightly
def test_a_million_triangles_build_in_three_seconds():
    triangles = random_triangles(1_000_000, size=0.01)
    start = time.perf_counter()
    hierarchy = bvh.build(triangles)
    seconds = time.perf_counter() - start
    print(f"{seconds:.2f} s, cost {hierarchy.cost:.1f}, stack {hierarchy.stack_size}")
    assert seconds < 3


# Refitting
# ---------------------------------------------------------------------------------------------------------------------


def moved_apart(triangles, seed=4):
    """The same triangles elsewhere, each on its own way."""
    generator = np.random.default_rng(seed)
    return (triangles + generator.normal(0, 0.2, (len(triangles), 1, 3))).astype(np.float32)


def assert_boxes_fit(hierarchy, triangles):
    boxes = hierarchy.nodes[:, :6].reshape(-1, 2, 3, bvh.WIDTH)
    for node, slot, first, stop in leaves(hierarchy):
        corners = triangles[hierarchy.order[first:stop]].reshape(-1, 3)
        np.testing.assert_array_equal(boxes[node, :, :, slot], [corners.min(axis=0), corners.max(axis=0)])
    for node, slot in np.argwhere((hierarchy.nodes[:, 6] >= 0) & (boxes[:, 0, 0] <= boxes[:, 1, 0])):
        inner = boxes[int(hierarchy.nodes[node, 6, slot])]
        np.testing.assert_array_equal(boxes[node, :, :, slot], [inner[0].min(axis=1), inner[1].max(axis=1)])


def test_refitted_boxes_fit_exactly(triangles):
    built = bvh.build(triangles)
    there = moved_apart(triangles)
    refitted, fresh = bvh.refit(built, there)
    assert_boxes_fit(refitted, there)
    np.testing.assert_array_equal(fresh, np.arange(len(built.nodes)))
    np.testing.assert_array_equal(built.nodes, bvh.build(triangles).nodes)  # the old one was left alone
    back, _ = bvh.refit(refitted, triangles)
    np.testing.assert_array_equal(back.nodes, built.nodes)
    np.testing.assert_allclose([back.cost, back.extent], [built.cost, built.extent], rtol=1e-9)


def test_refitting_a_part_is_refitting_all(triangles):
    built = bvh.build(triangles)
    changed = np.random.default_rng(2).random(len(triangles)) < 0.05
    changed[0] = True
    there = np.where(changed[:, None, None], moved_apart(triangles), triangles)
    part, fresh = bvh.refit(built, there, changed)
    whole, _ = bvh.refit(built, there)
    np.testing.assert_array_equal(part.nodes, whole.nodes)
    np.testing.assert_allclose([part.cost, part.extent], [whole.cost, whole.extent], rtol=1e-6)
    untouched = np.setdiff1d(np.arange(len(built.nodes)), fresh)
    np.testing.assert_array_equal(part.nodes[untouched], built.nodes[untouched])
    assert len(fresh) < len(built.nodes) or len(triangles) < 1000


def test_refitted_trees_give_the_same_answers(triangles):
    there = moved_apart(triangles)
    origins, directions = random_rays(1000)
    origins = origins + there.reshape(-1, 3).mean(axis=0)
    refitted, _ = bvh.refit(bvh.build(triangles), there)
    found, cost = rays.traverse(refitted, there, origins, directions)
    assert (found.distance == rays.closest_hit(there.astype(float), origins, directions).distance).all()
    assert cost.stack.max() <= refitted.stack_size


def test_cost_counts_what_a_random_ray_meets():
    """A leaf of two triangles and one of one at the ends of a unit cube: half surfaces 3 of the root, 1 of each
    leaf."""
    ends = np.array(
        [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 1, 1], [1, 0, 1]], [[0, 0, 0], [1, 1, 0], [1, 0, 0]]]
    )
    built = bvh.build(ends.astype(np.float32))
    assert built.extent == 3.0
    np.testing.assert_allclose(built.cost, 1 + (2 * 1 + 1) / 3)  # the leaf of two, and the one


@pytest.mark.parametrize(
    "name,stretch",
    [("still", False), ("shifted", False), ("grown", False), ("a part a little", False), ("shuffled", True)],
)
def test_when_building_again_is_better(name, stretch):
    triangles = random_triangles(2000, size=0.02)
    part = np.arange(2000)[:, None, None] < 100
    there = {
        "still": triangles,
        "shifted": triangles + np.float32(30),
        "grown": triangles * np.float32(1.1),
        "a part a little": np.where(part, triangles + np.float32(0.05), triangles),
        "shuffled": triangles[np.random.default_rng(0).permutation(2000)],
    }[name].astype(np.float32)
    built = bvh.build(triangles)
    assert bvh.stretched(bvh.refit(built, there)[0], built) == stretch


# Rays
# ---------------------------------------------------------------------------------------------------------------------


def test_a_ray_against_a_triangle_in_closed_form():
    triangle = np.array([[[0, 0, 2.0], [4, 0, 2], [0, 4, 2]]])
    hits = rays.closest_hit(
        triangle,
        np.array([[1.0, 2, 0], [3, 3, 0], [1, 2, 4], [1, 2, 4]]),
        np.array([[0, 0, 1.0], [0, 0, 1], [0, 0, -1], [0, 0, 1]]),
    )
    np.testing.assert_allclose(hits.distance, [2, np.inf, 2, np.inf])
    np.testing.assert_array_equal(hits.triangle, [0, -1, 0, -1])
    np.testing.assert_allclose(hits.barycentric[0], [0.25, 0.5], atol=1e-15)


def test_rays_at_shared_edges_and_corners_hit_something():
    mesh = grid_mesh(4).astype(float)
    x, y = np.meshgrid(np.linspace(0, 4, 33), np.linspace(0, 4, 33))  # on corners, edges and diagonals
    targets = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    for origin in ([2.0, 2, 5], [0.3, 7, 2], [-3, -3, 0.5]):
        directions = targets - origin
        distance = rays.closest_hit(
            mesh * [1.25, 1.25, 1] - [0.5, 0.5, 0], np.tile(origin, (len(directions), 1)), directions
        ).distance
        np.testing.assert_allclose(distance, 1, rtol=1e-12)


def test_no_ray_escapes_a_closed_mesh():
    generator = np.random.default_rng(0)
    corners = np.array(list(np.ndindex(2, 2, 2)), float) + generator.uniform(-0.1, 0.1, (8, 3))
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    mesh = np.array(
        [[corners[a], corners[b], corners[c]] for a, b, c, _ in quads]
        + [[corners[a], corners[c], corners[d]] for a, b, c, d in quads]
    )
    # two thirds of the rays aim at edges and corners, where leaks are
    onto_edges = mesh[generator.integers(0, 12, 20_000)]
    t = generator.random((20_000, 1))
    targets = np.concatenate(
        [onto_edges[:, 0] * t + onto_edges[:, 1] * (1 - t), corners[generator.integers(0, 8, 1000)]]
    )
    origins = generator.uniform(0.3, 0.7, targets.shape)
    assert np.isfinite(rays.closest_hit(mesh, origins, targets - origins).distance).all()


def test_holes_let_rays_through():
    triangle = np.array([[[0, 0, 2.0], [4, 0, 2], [0, 4, 2]], [[0, 0, 3.0], [4, 0, 3], [0, 4, 3]]])
    up = np.array([[0, 0, 1.0], [0, 0, 1]])
    origins = np.array([[0.5, 1.0, 0], [2, 1, 0]])

    def is_hole(index, barycentric, _directions):
        return (index == 0) & (barycentric[:, 0] < 0.25)

    np.testing.assert_array_equal(rays.closest_hit(triangle, origins, up, is_hole).triangle, [1, 0])
    np.testing.assert_array_equal(rays.any_hit(triangle, origins, up, np.array([2.5, 2.5]), is_hole), [False, True])
