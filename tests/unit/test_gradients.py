# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradients of probes against closed forms, and the lookup that follows them."""

import numpy as np
import pytest
from gridlight.core import gradients, lookup
from gridlight.core import spherical_harmonics as sh
from gridlight.core.cubemap import texel_directions
from gridlight.core.field import Field
from gridlight.core.grid import Grid

BAND_0 = 0.28209479177387814


def some_directions(count, seed=0):
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


# Formulas
# ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bands", [1, 2, 3])
def test_basis_gradient_is_the_derivative_along_the_sphere(bands):
    directions = some_directions(100)
    found = sh.basis_gradient(directions, bands)
    step = 1e-5
    for axis in np.eye(3):
        tangent = axis - directions * (directions @ axis)[:, None]
        ahead, behind = (
            sh.basis(moved / np.linalg.norm(moved, axis=1, keepdims=True), bands)
            for moved in (directions + step * tangent, directions - step * tangent)
        )
        np.testing.assert_allclose(found @ axis, (ahead - behind) / (2 * step), atol=1e-8)


@pytest.mark.parametrize("face", [1, 4, 7])
def test_every_texel_has_four_edges(face):
    edges = gradients.texel_edges(face)
    centre = texel_directions(face).reshape(-1, 3)
    assert len(edges.first) == 12 * face**2
    assert (np.bincount(np.concatenate([edges.first, edges.second])) == 4).all()
    assert len(np.unique(np.sort([edges.first, edges.second], axis=0), axis=1).T) == 12 * face**2
    np.testing.assert_allclose(np.einsum("ei,ei->e", edges.direction, edges.across), 0, atol=1e-15)
    assert (np.einsum("ei,ei->e", centre[edges.second] - centre[edges.first], edges.across) > 0).all()
    length = np.linalg.norm(edges.across, axis=1)
    along_circles = length.sum() / (2 * np.pi)
    assert face > 1 or along_circles == pytest.approx(12 * np.arccos(1 / 3) / (2 * np.pi)), "12 edges of a cube"


def test_point_gradient_is_the_derivative_of_what_points_send():
    """Σ L A cosθ/r² Y(ω) of ten small surfaces, moved by hand."""
    generator = np.random.default_rng(1)
    points = some_directions(10, 2) * generator.uniform(1, 3, (10, 1))
    normals = some_directions(10, 3)
    normals[np.abs(np.einsum("ni,ni->n", normals, points)) < 0.3] = [0, 0, 1]
    radiance = generator.uniform(0.1, 1, (10, 3))

    def seen(probe):
        offset = points - probe
        distance = np.linalg.norm(offset, axis=1)
        direction = offset / distance[:, None]
        cosine = np.abs(np.einsum("ni,ni->n", direction, normals))
        return direction, distance, radiance * (cosine / distance**2)[:, None]

    direction, distance, flux = seen(np.zeros(3))
    assert np.abs(np.einsum("ni,ni->n", direction, normals)).min() > gradients.LEAST_COSINE
    found = gradients.point_gradient(direction, distance, normals, flux, 1e-6, 3)
    step = 1e-5
    for axis in range(3):
        ahead, behind = (seen(sign * step * np.eye(3)[axis]) for sign in (1, -1))
        change = [sh.project(flux, direction, np.ones(10), 3) for direction, _distance, flux in (ahead, behind)]
        np.testing.assert_allclose(found[axis], (change[0] - change[1]) / (2 * step), atol=1e-7)


# Fields that are known
# ----------------------------------------------------------------------------------------------------------------------


def gradient_of(trace, face=64, nearest=1e-6):
    """(3, 9) of a probe that sees ``trace(directions)``, radiance (X,) from distance (X,), along its texels."""
    radiance, distance = trace(texel_directions(face).reshape(-1, 3))
    outside = np.zeros((1, len(radiance)), bool)
    edges = gradients.texel_edges(face)
    radiance = np.repeat(radiance[None, :, None], 3, axis=2)
    return gradients.edge_gradient(edges, radiance, distance[None], outside, nearest, 3)[0, :, :, 0]


def ball_coefficients(centre, radius):
    """(9,) of a ball of radiance 1: a cap of half angle α, Y_lm · 2π ∫ P_l from cos α to 1."""
    distance = np.linalg.norm(centre)
    c = np.sqrt(1 - (radius / distance) ** 2)
    zonal = 2 * np.pi * np.array([1 - c, (1 - c * c) / 2, (c - c**3) / 2])
    return sh.basis(centre / distance, 3) * zonal[[0, 1, 1, 1, 2, 2, 2, 2, 2]]


@pytest.mark.parametrize("centre", [(2.0, 0.3, -0.4), (-1.0, 1.2, 1.5)])
@pytest.mark.parametrize("behind", [np.inf, 5.0])
def test_a_glowing_ball(centre, behind):
    """Whatever is dark behind it, however far: the nearer one of two moves. The ball's distance is that of its rim,
    where rays through the middles of texels do not quite get."""
    centre, radius = np.array(centre), 0.8

    def trace(directions):
        along = directions @ centre
        hidden = radius**2 - centre @ centre + along**2
        hit = (hidden > 0) & (along > 0)
        return hit.astype(float), np.where(hit, np.sqrt(centre @ centre - radius**2), behind)

    step = 1e-4
    expected = np.stack(
        [
            (ball_coefficients(centre - step * e, radius) - ball_coefficients(centre + step * e, radius)) / (2 * step)
            for e in np.eye(3)
        ]
    )
    found = gradient_of(trace)
    assert np.linalg.norm(found - expected) < 0.02 * np.linalg.norm(expected)


def test_light_that_shows_through_a_window_moves_with_the_window():
    """A dark wall at 1 m with a round hole, the sky behind: the mirror image of a disc that glows at 1 m."""

    def window(directions):
        down = directions[:, 2] < -1e-9
        distance = np.where(down, -1 / np.where(down, directions[:, 2], -1), np.inf)
        across = np.where(down, np.hypot(*directions[:, :2].T) * np.where(down, distance, 0), np.inf)
        through = across < 0.5
        return through.astype(float), np.where(through, np.inf, distance)

    def disc(directions):
        radiance, _distance = window(directions)
        return radiance, np.where(radiance > 0, -1 / np.where(radiance > 0, directions[:, 2], -1), np.inf)

    found, mirrored = gradient_of(window), gradient_of(disc)
    # dΩ/dh of a disc of radius a below: Ω = 2π(1 − h/√(h² + a²)), rises as h falls
    expected = -2 * np.pi * 0.25 / (1 + 0.25) ** 1.5
    assert mirrored[2, 0] / BAND_0 == pytest.approx(expected, rel=0.03)
    assert found[2, 0] / BAND_0 == pytest.approx(expected, rel=0.03)
    np.testing.assert_allclose(found[:2, 0], 0, atol=0.02)


@pytest.mark.parametrize("face", [16, 32])
def test_an_endless_lit_wall_looks_the_same_from_everywhere(face):
    """Only the horizon has an edge, and it is far; texels just below it are not, so this holds to a texel's size."""

    def trace(directions):
        below = directions[:, 2] < 0
        return below.astype(float), np.where(below, -1 / np.where(below, directions[:, 2], -1), np.inf)

    found = gradient_of(trace, face)
    assert np.abs(found).max() < 3.0 / face


def test_the_same_light_everywhere_has_no_gradient():
    def trace(directions):
        return np.full(len(directions), 2.0), 1 / np.abs(directions).max(axis=1)

    assert not gradient_of(trace, 8).any()


def test_dark_insides_have_no_edges():
    face = 8
    inside = texel_directions(face).reshape(1, -1, 3)[..., 0] > 0.3
    radiance = np.repeat(np.where(inside, 0.0, 1.0)[..., None], 3, axis=2)
    distance = np.where(inside, 0.2, 3.0)
    edges = gradients.texel_edges(face)
    assert not gradients.edge_gradient(edges, radiance, distance, inside, 1e-3, 3).any()
    assert gradients.edge_gradient(edges, radiance, distance, ~inside & inside, 1e-3, 3).any()


# Limits
# ----------------------------------------------------------------------------------------------------------------------


def turned_grid(resolution=(4, 3, 5)):
    rotation, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation * [3, 2, 2], (5, 6, 7)
    return Grid(matrix, resolution)


def open_field(grid, seed=0):
    """Probes that see nothing near, with any light and any gradient."""
    field = Field.empty(grid, 3)
    generator = np.random.default_rng(seed)
    field.coefficients[:] = generator.normal(size=field.coefficients.shape)
    field.gradient[:] = generator.normal(size=field.gradient.shape)
    field.depth[..., 0] = lookup.depth_clamp(grid)
    field.depth[..., 1] = lookup.depth_clamp(grid) ** 2
    return field


def points_in(grid, count, reach, seed=0):
    inside = np.random.default_rng(seed).uniform(-reach, reach, (count, 3))
    return inside @ grid.matrix[:3, :3].T + grid.center, some_directions(count, seed)


def test_per_cell_is_the_change_from_node_to_node():
    grid = turned_grid()
    slope = np.array([0.3, -0.2, 0.5])
    gradient = np.broadcast_to(slope[:, None, None], (grid.count, 3, 1, 3))
    value = (grid.positions() @ slope).reshape(grid.resolution[::-1])
    found = gradients.per_cell(grid, gradient)[0, :, 0, 0]
    for axis in range(3):
        np.testing.assert_allclose(np.diff(value, axis=2 - axis), found[axis], rtol=1e-12)


def test_an_axis_with_one_node_has_no_cell():
    grid = turned_grid((3, 1, 2))
    found = gradients.per_cell(grid, np.ones((6, 3, 1, 3)))
    assert found[:, [0, 2]].any() and not found[:, 1].any()


def test_limited_light_never_turns_negative():
    """Band 0 is light. However steep its gradients, no lookup goes below zero, inside or past the box, and gradients
    that are gentle enough stay what they are."""
    field = open_field(turned_grid(), 3)
    field.coefficients[:] = 0
    field.coefficients[:, 0] = np.random.default_rng(4).uniform(0, 2, (field.grid.count, 3))
    field.gradient[:, :, 1:] = 0
    field.gradient *= np.array([0.01, 0.1, 1, 100])[np.arange(field.grid.count) % 4, None, None, None]
    points, normals = points_in(field.grid, 3000, 1.5)
    assert lookup.irradiance(field, points, normals).min() < -1
    alone = np.zeros(field.grid.count, bool)
    limited = gradients.limited(field.grid, field.gradient, field.coefficients, alone)
    gentle = (
        np.abs(gradients.per_cell(field.grid, field.gradient[:, :, :1])).sum(axis=(1, 2)) <= field.coefficients[:, 0]
    )
    gentle = gentle.all(axis=1)
    assert gentle.sum() > 10 and np.array_equal(limited[gentle], field.gradient[gentle])
    field.gradient = limited
    found = lookup.irradiance(field, points, normals)
    assert found.min() >= -1e-6 and found.max() < 4 * np.pi * BAND_0 * 1.001


def test_dark_probes_and_negative_light_are_limited_without_fuss():
    grid = Grid.from_bounds((0, 0, 0), (1, 1, 1), (2, 1, 1))
    gradient = np.ones((2, 3, 4, 3), np.float32)
    coefficients = np.zeros((2, 4, 3), np.float32)
    coefficients[1, 0] = -0.25
    found = gradients.limited(grid, gradient, coefficients, np.zeros(2, bool))
    assert np.isfinite(found).all() and not found[0].any()
    np.testing.assert_allclose(found[1], 0.5)


def ramp(grid, per_cell):
    """Coefficients of band 0 that grow by one a cell along x, and a gradient of ``per_cell`` along x and y."""
    coefficients = np.zeros((grid.count, 9, 3), np.float32)
    coefficients[:, 0] = 50.0 + np.arange(grid.resolution[0])[np.arange(grid.count) % grid.resolution[0], None]
    gradient = np.zeros((grid.count, 3, 9, 3), np.float32)
    per_metre = np.linalg.pinv(gradients.cell_axes(grid))[:2].sum(axis=0) * per_cell
    gradient[:, :, 0] = per_metre[:, None]
    return coefficients, gradient


@pytest.mark.parametrize("per_cell, kept", [(0.5, 0.5), (1.0, 1.0), (-1.4, -1.4), (4.0, 1.5), (-4.0, -1.5)])
def test_gradients_are_as_steep_as_neighbours_allow(per_cell, kept):
    """Along the ramp up to one and a half times its slope, across it not at all, whichever way the grid lies."""
    grid = turned_grid((4, 3, 5))
    coefficients, gradient = ramp(grid, per_cell)
    limited = gradients.limited(grid, gradient, coefficients, np.ones(grid.count, bool))
    found = gradients.per_cell(grid, limited)[:, :, 0]
    np.testing.assert_allclose(found[:, 0], kept, rtol=1e-5)
    np.testing.assert_allclose(found[:, 1:], 0, atol=1e-5)


def test_only_neighbours_that_are_known_tell_what_is_steep():
    grid = Grid.from_bounds((0, 0, 0), (2, 2, 1), (3, 3, 1))
    coefficients, gradient = ramp(grid, 4.0)
    known = np.array([1, 1, 1, 0, 1, 0, 0, 0, 0], bool)
    limited = gradients.per_cell(grid, gradients.limited(grid, gradient, coefficients, known))[:, :, 0, 0]
    np.testing.assert_allclose(limited[:3, 0], 1.5, rtol=1e-6)
    np.testing.assert_allclose(limited[[0, 2], 1], 4.0, rtol=1e-6)  # above them nobody is known
    np.testing.assert_allclose(limited[[1, 4], 1], 0.0, atol=1e-6)
    np.testing.assert_allclose(limited[4, 0], 4.0, rtol=1e-6)
    np.testing.assert_allclose(limited[~known], [[4.0, 4.0, 0.0]] * 5, rtol=1e-6)


# The lookup
# ----------------------------------------------------------------------------------------------------------------------


def irradiance_of_band_0(value):
    return np.repeat(np.asarray(value)[:, None], 3, axis=1) / (np.pi * BAND_0)


def test_quadratic_light_is_reproduced_in_open_space():
    """Without gradients trilinear interpolation is off by the curvature."""
    field = open_field(turned_grid())
    curve = np.array([[0.3, 0.1, 0.0], [0.1, -0.2, 0.05], [0.0, 0.05, 0.1]])
    slope = np.array([0.5, -0.3, 0.2])
    centre = field.grid.center

    def light(points):
        offset = points - centre
        return 10 + offset @ slope + np.einsum("ni,ij,nj->n", offset, curve, offset)

    field.coefficients[:] = 0
    field.coefficients[:, 0] = irradiance_of_band_0(light(field.grid.positions()))
    field.gradient[:] = 0
    change = slope + 2 * (field.grid.positions() - centre) @ curve
    for axis in range(3):
        field.gradient[:, axis, 0] = irradiance_of_band_0(change[:, axis])
    points, normals = points_in(field.grid, 500, 1.0)
    found = lookup.irradiance(field, points, normals)[:, 0]
    np.testing.assert_allclose(found, light(points), rtol=1e-5)
    field.gradient[:] = 0
    assert np.abs(lookup.irradiance(field, points, normals)[:, 0] - light(points)).max() > 0.1


@pytest.mark.parametrize("resolution", [(4, 3, 5), (1, 3, 1)])
def test_nodes_stay_what_they_are(resolution):
    field = open_field(turned_grid(resolution))
    normals = some_directions(field.grid.count, 5)
    found = lookup.irradiance(field, field.grid.positions(), normals)
    np.testing.assert_allclose(found, sh.irradiance(field.coefficients, normals), rtol=1e-6, atol=1e-6)


def test_every_coefficient_follows_its_gradient_past_the_box():
    """Past a corner of the box there is one probe: its light and all of its gradient, for half a cell."""
    field = open_field(Grid.from_bounds((0, 0, 0), (3, 2, 2), (4, 3, 3)))
    normals = some_directions(50, 7)
    for reach, used in ((0.3, 0.3), (0.5, 0.5), (4.0, 0.5)):
        found = lookup.irradiance(field, np.tile([-reach, -reach, -reach], (50, 1)), normals)
        moved = field.coefficients[0] - used * field.gradient[0].sum(axis=0)
        np.testing.assert_allclose(found, sh.irradiance(moved, normals), rtol=1e-5, atol=1e-6)


def test_light_is_continuous_across_cells_and_the_box():
    field = open_field(turned_grid())
    start, end = points_in(field.grid, 2, 1.6, 9)[0]
    way = start + np.linspace(0, 1, 40001)[:, None] * (end - start)
    found = lookup.irradiance(field, way, np.tile([0.0, 0.6, 0.8], (len(way), 1)))
    assert np.abs(np.diff(found, axis=0)).max() < 2e-3


def test_gradients_lead_the_rest_of_the_way_where_probes_are_hidden():
    """Half of the way from each node for the trilinear blend; all of it from one that is left alone."""
    field = open_field(Grid.from_bounds((0, 0, 0), (1, 1, 1), (2, 2, 2)))
    points = np.array([[0.5, 0.5, 0.5], [0.4, 0.1, 0.3], [0.9, 0.2, 0.2]])
    nodes, even = lookup.trilinear(field.grid, points)
    assert nodes.shape == even.shape == (3, 8)
    np.testing.assert_allclose(lookup.gradient_steps(field.grid, points, even)[:, 0], points / 2)
    alone = np.tile(np.eye(8)[0], (3, 1))
    np.testing.assert_allclose(lookup.gradient_steps(field.grid, points, alone)[:, 0], np.minimum(points, 0.5))


@pytest.mark.parametrize("hidden", [[7], [0, 3], [1, 2, 4, 6], [1, 2, 3, 4, 5, 6, 7]])
def test_linear_light_is_reproduced_whichever_probes_are_hidden(hidden):
    """As far as gradients are followed: here within half a cell of what is left."""
    field = open_field(Grid.from_bounds((0, 0, 0), (2, 2, 2), (2, 2, 2)))
    slope = np.array([0.5, -0.3, 0.2])
    field.coefficients[:] = 0
    field.coefficients[:, 0] = irradiance_of_band_0(10 + field.grid.positions() @ slope)
    field.gradient[:] = 0
    field.gradient[:, :, 0] = irradiance_of_band_0(slope)
    field.depth[hidden, :, :2] = 0.01, 0.0001
    field.coefficients[hidden] *= 9
    left = np.setdiff1d(np.arange(8), hidden)
    near = field.grid.positions()[left[0]]
    points = near + 0.99 * (np.random.default_rng(1).random((200, 3)) * np.where(near > 1, -1, 1))
    found = lookup.irradiance(field, points, some_directions(200))[:, 0]
    within = (np.abs(lookup.gradient_steps(field.grid, points, _weights(field, points, left))) < 0.5).all(axis=(1, 2))
    assert within.sum() > 50
    np.testing.assert_allclose(found[within], (10 + points @ slope)[within], rtol=1e-5)


def _weights(field, points, left):
    """(N, 8) trilinear ones of the nodes that are ``left``, alone."""
    nodes, weights = lookup.trilinear(field.grid, points)
    weights = np.where(np.isin(nodes, left), weights, 0.0)
    return weights / weights.sum(axis=1, keepdims=True)


def test_fields_without_gradients_are_read_as_before():
    field = open_field(turned_grid())
    field.gradient[:] = 0
    points, normals = points_in(field.grid, 200, 1.0)
    nodes, weights = lookup.trilinear(field.grid, points)
    plain = sh.irradiance(np.einsum("nw,nwkc->nkc", weights, field.coefficients[nodes].astype(float)), normals)
    np.testing.assert_allclose(lookup.irradiance(field, points, normals), plain, rtol=1e-6, atol=1e-6)
