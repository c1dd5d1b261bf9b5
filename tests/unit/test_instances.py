# SPDX-License-Identifier: GPL-3.0-or-later
"""Two-level hierarchies give the answers of one flattened one."""

import numpy as np
import pytest
import two_level_hierarchy as instances
from gridlight.core import bvh, rays


def placed(generator, count, spread=2.0):
    """(count, 4, 4) random rotations, uneven scales and places, some mirrored."""
    matrices = np.tile(np.eye(4), (count, 1, 1))
    turn = np.linalg.qr(generator.normal(size=(count, 3, 3)))[0]
    matrices[:, :3, :3] = turn * generator.uniform(0.5, 1.5, (count, 1, 3))
    matrices[:, :3, 3] = generator.uniform(-spread, spread, (count, 3))
    return matrices


def meshes(seed=0):
    generator = np.random.default_rng(seed)
    return [
        instances.Mesh(
            (generator.normal(0, 0.4, (size, 1, 3)) + generator.normal(0, 0.1, (size, 3, 3))).astype(np.float32), m
        )
        for size, m in ((50, placed(generator, 7)), (1, placed(generator, 3)), (200, placed(generator, 1)))
    ]


def flattened(parts):
    """(T, 3, 3) world triangles in the order that hits count them."""
    return np.concatenate(
        [part.triangles.astype(float) @ m[:3, :3].T + m[:3, 3] for part in parts for m in part.matrices]
    )


@pytest.mark.parametrize("seed", range(3))
def test_the_same_hits_as_testing_every_triangle(seed):
    parts = meshes(seed)
    generator = np.random.default_rng(seed + 10)
    origins, directions = generator.uniform(-3, 3, (600, 3)), generator.normal(size=(600, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hierarchy = instances.build(parts)
    found, cost, entered = instances.traverse(hierarchy, origins, directions)
    expected = rays.closest_hit(flattened(parts), origins, directions)
    np.testing.assert_array_equal(found.triangle, expected.triangle)
    np.testing.assert_allclose(found.distance, expected.distance, rtol=1e-9)
    np.testing.assert_allclose(found.barycentric, expected.barycentric, atol=1e-7)
    assert (cost.nodes >= 1).all() and entered.max() <= len(hierarchy.mesh_of)


def test_boxes_of_instances_contain_them():
    parts = meshes()
    hierarchy = instances.build(parts)
    corners = flattened(parts).reshape(-1, 3)
    for node, slot in np.argwhere(hierarchy.top.nodes[:, 0] <= hierarchy.top.nodes[:, 3]):
        child = int(hierarchy.top.nodes[node, 6, slot])
        if child >= 0:
            continue
        first = -1 - child
        inside = hierarchy.top.order[first : first + int(np.argmax(hierarchy.top.leaf_end[first:])) + 1]
        low, high = hierarchy.top.nodes[node, 0:3, slot], hierarchy.top.nodes[node, 3:6, slot]
        for instance in inside:
            start = hierarchy.first_triangle[instance] * 3
            size = len(parts[hierarchy.mesh_of[instance]].triangles) * 3
            mine = corners[start : start + size]
            assert (mine >= low - 1e-6).all() and (mine <= high + 1e-6).all()


def test_memory_grows_with_meshes():
    mesh = meshes()[2]
    many = instances.Mesh(mesh.triangles, placed(np.random.default_rng(1), 100))
    two_levels = instances.build([many])
    one_level = bvh.build(flattened([many]))
    assert two_levels.texels < 0.05 * instances.hierarchy_texels(one_level)
