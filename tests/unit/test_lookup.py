# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading the field: exact where it must be, between nodes, past the box, and around walls."""

import numpy as np
import pytest
from gridlight.core import lookup
from gridlight.core.conventions import CULLED, INVALID
from gridlight.core.cubemap import octahedral_encode, pack_normal
from gridlight.core.depth_map import map_directions, sample_directions, sample_inverse
from gridlight.core.field import Field
from gridlight.core.grid import Grid


def open_field(resolution=(4, 3, 3), matrix=None, bands=3):
    """A field whose probes see nothing near."""
    matrix = np.diag([3.0, 2, 2, 1]) if matrix is None else matrix
    field = Field.empty(Grid(matrix, resolution), bands)
    field.depth[..., 0] = lookup.depth_clamp(field.grid)
    field.depth[..., 1] = lookup.depth_clamp(field.grid) ** 2
    return field


def points_and_normals(count=200, reach=1.0, seed=0):
    generator = np.random.default_rng(seed)
    normals = generator.normal(size=(count, 3))
    return generator.uniform(-reach, reach, (count, 3)) * [3, 2, 2], normals / np.linalg.norm(
        normals, axis=1, keepdims=True
    )


def depth_of(distance_along):
    """(DEPTH_EDGE², DEPTH_VALUES) statistics of a distance given as a function of directions; nothing of planes."""
    distance = distance_along(map_directions())
    return np.stack([distance, distance**2, 0 * distance, 0 * distance], axis=1)


def test_uniform_light_is_uniform_everywhere():
    field = open_field()
    field.coefficients[:, 0] = np.array([1, 2, 3]) * np.sqrt(4 * np.pi)
    points, normals = points_and_normals(reach=3.0)
    np.testing.assert_allclose(
        lookup.irradiance(field, points, normals), np.tile(np.pi * np.array([1, 2, 3]), (200, 1)), rtol=1e-6
    )


def test_at_a_node_the_field_is_the_nodes():
    field = open_field()
    field.coefficients[:, 0, 0] = np.arange(field.grid.count)
    normals = np.tile([0, 0, 1.0], (field.grid.count, 1))
    found = lookup.irradiance(field, field.grid.positions(), normals)[:, 0]
    np.testing.assert_allclose(found, np.arange(field.grid.count) * np.pi * 0.28209479177387814, rtol=1e-9, atol=1e-9)


def test_rounding_does_not_take_a_node_from_a_probe_that_moved_away():
    """A probe that was moved behind a wall does not see its node. What float32 makes of the node's place, here or far
    away, must not hand it over to neighbours that do."""
    field = open_field((4, 4, 4), np.diag([3.0, 3, 3, 1]))
    node = 21
    field.offset[node] = 0.4
    field.depth[node, :, :2] = 0.05, 0.0025
    field.coefficients[:, 0] = 1.0
    field.coefficients[node, 0] = 9.0
    alone = field.grid.positions()[node]
    for away in (0.0, 1e-5, -1e-5):
        found = lookup.irradiance(field, (alone + away)[None], np.array([[0, 0, 1.0]]))
        np.testing.assert_allclose(found, 9 * np.pi * 0.28209479177387814, rtol=1e-6)
    assert lookup.irradiance(field, (alone + 0.02)[None], np.array([[0, 0, 1.0]])).max() < 2.0


def test_linear_light_is_reproduced_in_open_space():
    """Trilinear interpolation is exact for functions linear in x, y and z."""
    rotation, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation * [3, 2, 2], (5, 6, 7)
    field = open_field((4, 3, 5), matrix)
    slope = np.array([0.3, -0.2, 0.1])
    field.coefficients[:, 0] = (10 + field.grid.positions() @ slope)[:, None] / (np.pi * 0.28209479177387814)
    inside, normals = points_and_normals(reach=0.99)
    points = inside @ rotation.T + (5, 6, 7)
    np.testing.assert_allclose(lookup.irradiance(field, points, normals)[:, 0], 10 + points @ slope, rtol=1e-5)


def test_weights_sum_to_one_whatever_is_seen():
    field = open_field()
    generator = np.random.default_rng(2)
    field.depth[..., 0] = generator.uniform(0.01, 2, field.depth.shape[:2])
    field.depth[..., 1] = field.depth[..., 0] ** 2
    field.state[generator.random(len(field.state)) < 0.3] = CULLED
    field.state[generator.random(len(field.state)) < 0.3] = INVALID
    found = lookup.lookup_weights(field, *points_and_normals(1000, 2.0))
    total = found.of_corners.sum(axis=1)
    total[found.lacking] += found.of_around.sum(axis=1)
    np.testing.assert_allclose(total, 1, rtol=1e-12)
    assert 0 < len(found.lacking) < 1000, "some ask around"
    for nodes, weights in ((found.corners, found.of_corners), (found.around, found.of_around)):
        assert (weights >= 0).all() and nodes.min() >= 0 and nodes.max() < field.grid.count


def test_outside_the_box_the_nearest_face_counts():
    field = open_field()
    field.coefficients[:] = np.random.default_rng(3).random(field.coefficients.shape)
    points, normals = points_and_normals(100, 4.0)
    clamped = np.clip(points, [-3, -2, -2], [3, 2, 2])
    np.testing.assert_allclose(
        lookup.irradiance(field, points, normals), lookup.irradiance(field, clamped, normals), rtol=1e-5
    )


@pytest.mark.parametrize("resolution", [(1, 1, 1), (1, 3, 1), (2, 1, 4)])
def test_axes_with_one_node(resolution):
    field = open_field(resolution)
    field.coefficients[:, 0] = 1
    found = lookup.irradiance(field, *points_and_normals())
    np.testing.assert_allclose(found, np.pi * 0.28209479177387814, rtol=1e-6)


def test_a_probe_behind_a_wall_does_not_leak():
    """Two probes, a wall half way: the dark side must not see the bright probe's light."""
    field = open_field((2, 1, 1), np.diag([1.0, 1, 1, 1]))
    field.coefficients[1, 0] = 100
    for node, side in ((0, 1), (1, -1)):
        field.depth[node] = depth_of(
            lambda d, side=side: np.where(
                d[:, 0] * side > 1e-3, np.minimum(1 / np.maximum(d[:, 0] * side, 1e-3), 4), 4.0
            )
        )
    left = np.array([[-0.05, 0, 0], [-0.3, 0.2, 0.1]])
    found = lookup.irradiance(field, left, np.tile([-1.0, 0, 0], (2, 1)))
    assert (found < 0.05 * 100).all(), "less than a twentieth of what open space would show"
    right = lookup.irradiance(field, -left, np.tile([1.0, 0, 0], (2, 1)))
    assert (right > 0.9 * 100 * np.pi * 0.282).all()


def walled_row(wall):
    """Five probes in a row along x, a metre apart at −2 .. 2, and a wall across it at x = ``wall``: lit behind it."""
    field = open_field((5, 1, 1), np.diag([2.0, 1, 1, 1]))
    clamp = lookup.depth_clamp(field.grid)
    for node, x in enumerate(field.grid.positions()[:, 0]):

        def distance(d, x=x):
            along = d[:, 0] * np.sign(wall - x)
            return np.where(along > 1e-3, np.minimum(abs(wall - x) / np.maximum(along, 1e-3), clamp), clamp)

        field.depth[node] = depth_of(distance)
        field.coefficients[node, 0] = 100.0 if x > wall else 1.0
    return field


def test_a_cell_without_a_probe_that_sees_reads_the_next_ones():
    """Both probes of the cell from −1 to 0 are behind a wall, which bends away from the row: neither sees the point,
    the probe one step on does."""
    field = walled_row(-1.6)
    field.coefficients[0, 0] = 1.0
    found = lookup.lookup_weights(field, np.array([[-1.5, 0, 0]]), np.array([[1.0, 0, 0]]))
    assert not len(found.lacking) and found.of_corners[0, found.corners[0] == 1].sum() > 0.99, "a corner sees it"
    field.depth[1, :, :2] = 0.05, 0.0025  # but for something right before it
    found = lookup.lookup_weights(field, np.array([[-1.5, 0, 0]]), np.array([[1.0, 0, 0]]))
    assert found.of_around[0, found.around[0] == 2].sum() > 0.99
    found = lookup.irradiance(field, np.array([[-1.5, 0, 0]]), np.array([[1.0, 0, 0]]))
    np.testing.assert_allclose(found, 100 * np.pi * 0.28209479177387814, rtol=0.02)


def test_nothing_jumps_where_nodes_around_a_cell_come_in(monkeypatch):
    """However much the corners see, a little less of it makes little difference."""
    field = walled_row(-1.6)
    point, normal = np.array([[-1.5, 0, 0]]), np.array([[1.0, 0, 0]])
    sight = {0: 0.0, 1: 0.0, 2: 1.0, 3: 1.0, 4: 1.0}
    field.coefficients[:, 0] = np.arange(5)[:, None]
    found = []
    for corner in np.geomspace(1e-7, 1, 400):
        seen = np.array([corner if value == 0.0 else value for value in sight.values()])
        monkeypatch.setattr(lookup, "visibility", lambda _field, nodes, _points, _normals, seen=seen: seen[nodes])
        found.append(lookup.irradiance(field, point, normal)[0, 0])
    assert np.abs(np.diff(found)).max() < 0.03 * np.ptp(found) and np.ptp(found) > 1.0


def test_invalid_probes_lend_no_light_where_others_do():
    field = open_field()
    field.coefficients[:, 0] = 1
    field.state[::2] = INVALID
    field.coefficients[::2] = 1e3
    found = lookup.irradiance(field, *points_and_normals(100))
    np.testing.assert_allclose(found, np.pi * 0.28209479177387814, rtol=0.1)


def test_culled_probes_count_as_seen():
    field = open_field()
    field.depth[:] = 0.01  # would see nothing
    field.state[:] = CULLED
    field.coefficients[:, 0] = np.arange(field.grid.count)[:, None]
    weights = lookup.lookup_weights(field, *points_and_normals(100)).of_corners
    field.state[:] = 1
    field.depth[..., 0], field.depth[..., 1] = 10, 100
    plain = lookup.lookup_weights(field, *points_and_normals(100)).of_corners
    np.testing.assert_allclose(weights, plain, rtol=1e-9)


def test_the_depth_map_has_no_seams():
    """A smooth distance over the sphere, sampled across the folds of the map, stays smooth, and comes closer by no more
    than chords between texels do."""
    field = open_field((1, 1, 1))
    field.depth[0] = depth_of(lambda d: 2 + d @ [0.3, 0.5, -0.4])
    angle = np.linspace(0, 2 * np.pi, 4000)
    for axis in range(3):
        circle = np.roll(np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1), axis, axis=1)
        sampled = 1 / inverse_along(field, circle)
        assert np.abs(np.diff(sampled)).max() < 0.01
        share = sampled / (2 + circle @ [0.3, 0.5, -0.4])
        assert 0.92 < share.min() and share.max() < 1.02


def inverse_along(field, directions):
    """(N,) inverse of the distance that probe 0 knows of along ``directions`` (N, 3)."""
    nodes, unlimited, clamp = np.zeros(len(directions), int), np.full(len(directions), np.inf), 1e6
    anywhere = directions, np.zeros_like(directions)
    return sample_inverse(field.depth, clamp, nodes, directions, unlimited, anywhere)[:, 0] / clamp


@pytest.mark.parametrize("normal", [[1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [3, 4, 0], [1, -1, 1], [-2, 5, -4]])
def test_the_depth_map_knows_flat_walls_exactly(normal):
    """A wall in any direction and at any slant, across all folds of the map."""
    normal = np.array(normal) / np.linalg.norm(normal)
    field = open_field((1, 1, 1))
    field.depth[0] = depth_of(lambda d: 1.5 / np.maximum(d @ normal, 1e-4))
    directions = np.random.default_rng(5).normal(size=(5000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = directions[directions @ normal > 0.75]  # of which all four texels see the wall
    np.testing.assert_allclose(inverse_along(field, directions), directions @ normal / 1.5, rtol=1e-5)


def walls_around(probe, walls, clamp):
    """(DEPTH_EDGE², DEPTH_VALUES) statistics as a bake stores them of ``walls``, rows of a normal n and h: all x with
    n · x = h, seen from ``probe``."""
    inverse = np.maximum((sample_directions() @ walls[:, :3].T) / (walls[:, 3] - walls[:, :3] @ probe), 1.0 / clamp)
    middle = (map_directions() @ walls[:, :3].T) / (walls[:, 3] - walls[:, :3] @ probe)
    distance = 1.0 / inverse.max(axis=2)
    normals = np.where((middle.max(axis=1) > 1e-6)[:, None], -walls[middle.argmax(axis=1), :3], -map_directions())
    packed = pack_normal(octahedral_encode(normals))
    in_middle = np.where(middle.max(axis=1) > 1e-6, 1.0 / np.maximum(middle.max(axis=1), 1e-6), clamp)
    return np.stack([distance.mean(axis=1), (distance**2).mean(axis=1), packed, in_middle], axis=1)


@pytest.mark.parametrize("apart", [0.05, 0.3, 0.45])
def test_a_wall_seen_at_a_slant_hides_what_is_behind_it(apart):
    """A probe ``apart`` from a wall of 10 cm, in cells of 1 m: whoever stands behind the wall, however far along it,
    is not seen; who stands before it is."""
    field = open_field((2, 2, 2), np.diag([0.5, 0.5, 0.5, 1.0]))
    probe = field.grid.positions()[0]
    clamp = lookup.depth_clamp(field.grid)

    field.depth[0] = walls_around(probe, np.array([[1.0, 0, 0, probe[0] + apart]]), clamp)
    random = np.random.default_rng(4)
    along = random.uniform(0, 1, (2000, 2))
    behind = probe + np.column_stack([np.full(2000, apart + 0.1 + 0.02), along])
    nodes = np.zeros((2000, 1), int)
    anywhere = np.zeros((2000, 3))  # no surface to be moved off
    assert lookup.visibility(field, nodes, behind, anywhere).mean() < 0.1
    before = probe + np.column_stack([np.full(2000, 0.5 * apart), along])
    # A probe at 5 cm cannot tell what is half way to the wall and far along it: others take its part.
    assert lookup.visibility(field, nodes, before, anywhere).mean() > (0.15 if apart < 0.1 else 0.9)


def convex_rooms():
    """Walls, as ``walls_around`` has them, of rooms in which everything sees everything."""
    box = np.concatenate([np.eye(3), -np.eye(3)])
    upright = np.column_stack([box, [2.0, 1.5, 1.3, 2.0, 1.5, 1.3]])
    turn, _ = np.linalg.qr(np.random.default_rng(6).normal(size=(3, 3)))
    attic = np.concatenate([upright, [[0.0, 0.6, 0.8, 1.2], [0.0, -0.6, 0.8, 1.2]]])
    return {"upright": upright, "askew": np.column_stack([box @ turn.T, upright[:, 3]]), "under a roof": attic}


def convex_room(name):
    """(walls, field of a volume within them that knows of nothing else)."""
    walls, field = convex_rooms()[name], open_field((3, 3, 3), np.diag([0.9, 0.7, 0.6, 1.0]))
    for node, place in enumerate(field.grid.positions()):
        field.depth[node] = walls_around(place, walls, lookup.depth_clamp(field.grid))
    return walls, field


@pytest.mark.parametrize("room", convex_rooms())
def test_in_a_convex_room_every_probe_sees_every_place(room):
    """On its walls, in its edges and its corners: nothing is in the way."""
    walls, field = convex_room(room)
    points, normals = places_on(walls, 3000)
    nodes, plain = lookup.trilinear(field.grid, points)
    seen = lookup.visibility(field, nodes, points, normals)
    mean = (plain * seen).sum(axis=1)
    assert mean.mean() > 0.93 and mean[::3].mean() > 0.83, f"{mean.mean()}, in edges {mean[::3].mean()}"


def places_on(walls, count):
    """(points, normals) at random on the inside of a convex room, a third of them within centimetres of edges."""
    random = np.random.default_rng(8)
    directions = random.normal(size=(count, 3))
    directions[::3] = np.sign(directions[::3]) * walls[:3, 3] + 0.05 * directions[::3]  # towards the corners of the box
    reach = walls[:, 3] / np.maximum(directions @ walls[:, :3].T, 1e-9)
    return directions * reach.min(axis=1, keepdims=True), -walls[reach.argmin(axis=1), :3]


def test_what_stands_behind_a_wall_of_a_convex_room_is_hidden():
    walls, field = convex_room("askew")
    points, normals = places_on(walls, 3000)
    nodes, plain = lookup.trilinear(field.grid, points)
    behind = lookup.visibility(field, nodes, points - 0.1 * normals, -normals)  # a wall of 10 cm, its other side
    assert (plain * behind).sum(axis=1).mean() < 1e-3


@pytest.mark.parametrize("end", [-0.35, -0.1, 0.04, 0.2, 0.4])
def test_a_single_plane_that_ends_within_a_texel_hides_its_back(end):
    """All of the back, however near to the end, whatever of it the texel there sees; and nothing of the front."""
    field = open_field((2, 2, 2), np.diag([0.5, 0.5, 0.5, 1.0]))
    probe, clamp = field.grid.positions()[0], lookup.depth_clamp(field.grid)

    def distances(directions):
        onto = 0.4 / np.maximum(directions[..., 0], 1e-6)
        return np.where((directions[..., 1] * onto < end) & (onto < clamp), onto, clamp)

    distance, middle = distances(sample_directions()), distances(map_directions())
    normals = np.where((middle < clamp)[:, None], [-1.0, 0, 0], -map_directions())
    packed = pack_normal(octahedral_encode(normals))
    field.depth[0] = np.stack([distance.mean(axis=1), (distance**2).mean(axis=1), packed, middle], axis=1)
    random = np.random.default_rng(9)
    along = np.column_stack([end - random.uniform(0.002, 0.15, 500), random.uniform(-0.4, 0.4, 500)])
    nodes, facing = np.zeros((500, 1), int), np.tile([1.0, 0, 0], (500, 1))
    behind = probe + np.column_stack([np.full(500, 0.402), along])
    hidden = lookup.visibility(field, nodes, behind, facing) < 1e-5
    assert hidden.all()
    before = probe + np.column_stack([np.full(500, 0.398), along])
    assert lookup.visibility(field, nodes, before, -facing).mean() > 0.95
