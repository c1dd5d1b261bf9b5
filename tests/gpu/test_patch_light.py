# SPDX-License-Identifier: GPL-3.0-or-later
"""Light between patches against closed forms: furnaces to rounding, walls that nothing leaks through, surfaces that
only rays see, final gathers, memory budgets."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material, World
from gridlight.gpu_shaders.patch_finder import PatchFinder
from small_scenes import bake, box, corridor, frame, furnace, irradiance_at_nodes, snapshot_of
from stages import Stages

Y00 = 0.28209479177387814
WHITE, BLACK = Material("white", (1.0, 1.0, 1.0)), Material("black", (0.0, 0.0, 0.0))


def series(albedo, count):
    """Radiance in a furnace after ``count`` bounces."""
    return sum(albedo**i for i in range(count + 1))


def relative_rms(found, expected):
    return np.sqrt(((found - expected) ** 2).mean() / (expected**2).mean())


# Furnaces
# ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("capture", ["raster", "trace"])
@pytest.mark.parametrize("albedo,bounces", [(0.0, 2), (0.5, 0), (0.5, 1), (0.9, 40)])
def test_bounces_of_a_furnace_to_rounding(albedo, bounces, capture):
    grid = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (3, 3, 3))
    result = bake(furnace(albedo), grid, BakeSettings(bounces=bounces, capture=capture))
    assert result.iterations == bounces + 1
    np.testing.assert_allclose(irradiance_at_nodes(result.field), series(albedo, bounces), rtol=5e-6)


@pytest.mark.parametrize("gather,bounces", [(1, 0), (1, 5), (2, 1), (3, 2)])
def test_final_gather_of_a_furnace_to_rounding(gather, bounces):
    """Paths add as many bounces as they have segments. An odd number of texels, so that rows of four do not fit."""
    grid = Grid.from_bounds([-0.81, -0.83, -0.77], [0.84, 0.79, 0.82], (3, 1, 1))
    result = bake(furnace(0.7), grid, BakeSettings(bounces=bounces, gather=gather, face=5, samples=3))
    np.testing.assert_allclose(irradiance_at_nodes(result.field), series(0.7, bounces + gather), rtol=5e-6)


def test_a_furnace_round_two_corners():
    """Probes in one arm of a glowing corridor. The other two arms are seen by rays only, the last by rays of what rays
    saw: bounces are exact all the same."""
    glowing = Material("glowing", (0.8, 0.8, 0.8), emission=(1.0, 1.0, 1.0))
    grid = Grid.from_bounds([0.2, 0.2, 0.2], [2.8, 0.8, 0.8], (4, 2, 2))
    result = bake(snapshot_of(corridor(), materials=[glowing]), grid, BakeSettings(bounces=30, keep_all=True))
    np.testing.assert_allclose(irradiance_at_nodes(result.field), series(0.8, 30), rtol=5e-6)


def test_a_plane_under_a_uniform_sky():
    """The floor reflects albedo · L: E(n) / π = L (½ + ½ n_z) + albedo L (½ − ½ n_z), exact with three bands."""
    floor = 1e3 * np.array([[[-1, -1, 0], [1, -1.1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]]) - [0, 0, 1]
    snapshot = snapshot_of(floor, materials=[Material("grey", (0.6, 0.6, 0.6))], world=World((0.2, 0.5, 1.0)))
    grid = Grid.from_bounds([-0.5] * 3, [0.5] * 3, (2, 2, 2))
    normals = np.array([[0, 0, 1.0], [0, 0, -1], [1, 0, 0], [0, -0.6, 0.8]])
    result = bake(snapshot, grid, BakeSettings(face=32, keep_all=True))
    assert result.converged and result.iterations > 1, "the first iteration is dark"
    up = normals[:, 2]
    expected = (0.5 + 0.5 * up + 0.6 * (0.5 - 0.5 * up))[:, None] * np.array([0.2, 0.5, 1.0])
    found = irradiance_at_nodes(result.field, normals)
    np.testing.assert_allclose(found, np.broadcast_to(expected, found.shape), atol=5e-3)


# No patch, one patch
# ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gather", [0, 1])
def test_where_nothing_reflects_there_is_no_patch(gather):
    """Black walls that glow: their light and nothing else, and a lamp that changes nothing."""
    lamp = Light("lamp", "POINT", (1.0, 1.0, 1.0), frame((0.3, 0.2, 0.1)))
    snapshot = replace(furnace(0.0, emission=0.5), lights=[lamp])
    grid = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (2, 2, 2))
    assert Stages(snapshot, grid, BakeSettings(face=4)).light.count == 0
    result = bake(snapshot, grid, BakeSettings(face=6, gather=gather))
    assert result.converged
    np.testing.assert_allclose(irradiance_at_nodes(result.field), 0.5, rtol=5e-6)


def test_one_wall_that_reflects():
    """A white floor in a black room below a lamp: nothing bounces, and each probe sees E/π of the floor. Band 0 by a
    fine sum over the floor: Σ Y₀₀ (I cos θ / d²) / π · cos θ' dA / r²."""
    lamp = Light("lamp", "POINT", (2.0, 3.0, 4.0), frame((0.3, 0.2, 0.5)))
    normals_up = box()[:, ::-1]
    on_floor = (normals_up[..., 2] < 0).all(axis=1)
    snapshot = snapshot_of(normals_up, on_floor.astype(int), [BLACK, WHITE], lights=[lamp])
    grid = Grid.from_bounds([-0.71, -0.63, -0.52], [0.64, 0.73, 0.67], (3, 3, 3))
    result = bake(snapshot, grid, BakeSettings(face=32, keep_all=True))
    x, y = (axis.ravel() for axis in np.meshgrid(*[(np.arange(400) + 0.5) / 200 - 1] * 2))
    floor = np.stack([x, y, np.full_like(x, -1.0)], axis=1)
    irradiance = 1.5 / np.linalg.norm(floor - [0.3, 0.2, 0.5], axis=1) ** 3
    offset = grid.positions()[:, None] - floor
    seen = (offset[..., 2] / np.linalg.norm(offset, axis=2) ** 3) @ irradiance * (1 / 200) ** 2 / np.pi
    expected = Y00 * seen[:, None] * [2.0, 3.0, 4.0]
    np.testing.assert_allclose(result.field.coefficients[:, 0], expected, rtol=1e-2)
    assert relative_rms(result.field.coefficients[:, 0], expected) < 3e-3


def test_uneven_light_is_the_mean_over_a_patch():
    """A lamp three centimetres from a wall: every patch gets the mean of I cos θ / d² over its points, however many
    samples that takes."""
    position = np.array([0.97, 0.1, -0.2])
    lamp = Light("lamp", "POINT", (1.0, 1.0, 1.0), frame(position))
    snapshot = snapshot_of(box()[:, ::-1], materials=[Material("grey", (0.5, 0.5, 0.5))], lights=[lamp])
    stages = Stages(snapshot, Grid.from_bounds([-0.8] * 3, [0.8] * 3, (3, 3, 3)), BakeSettings())
    points = stages.points[..., :3].astype(float)
    normals = -np.sign(points) * (np.abs(points) > 1 - 1e-4)
    flat = (np.abs(normals).sum(axis=2) == 1).all(axis=1)
    offset = position - points
    expected = np.einsum("npi,npi->np", offset, normals) / np.linalg.norm(offset, axis=2) ** 3
    uneven = expected.std(axis=1) / expected.mean()
    assert flat.mean() > 0.99 and (uneven[flat] > 6).any() and (uneven[flat] < 0.1).any()
    error = np.abs(stages.direct()[flat, 0] / expected.mean(axis=1)[flat] - 1)
    assert error[uneven[flat] > 1].max() < 2e-4, "all points take part"
    assert error.max() < 0.04, "where light is even, some do"


# Walls
# ----------------------------------------------------------------------------------------------------------------------


def two_rooms(thickness=0.1):
    """Two closed rooms of 4 m with a wall between, a lamp in the left one; cells of 28 cm reach through the wall."""
    wall = box((-thickness / 2, -2.1, -1.6), (thickness / 2, 2.1, 1.6))
    shell = box((-4, -2, -1.5), (4, 2, 1.5))[:, ::-1]
    lamp = Light("lamp", "POINT", (5.0, 5.0, 5.0), frame((-1.3, 0.4, 0.9)))
    grid = Grid.from_bounds([-3.6, -1.6, -1.1], [3.6, 1.6, 1.1], (4, 2, 2))
    return snapshot_of(np.concatenate([shell, wall]), objects=np.repeat([0, 1], 12), lights=[lamp]), grid


def brightness_of_rooms(**settings):
    """Band 0 (probes,) in the lit room, in the dark one."""
    snapshot, grid = two_rooms()
    result = bake(snapshot, grid, BakeSettings(keep_all=True, **settings))
    assert result.counts["active"] == 16 and not result.field.offset.any()
    mean = result.field.coefficients[:, 0].mean(axis=1)
    dark = grid.positions()[:, 0] > 0
    return mean[~dark], mean[dark]


@pytest.mark.parametrize("gather", [0, 1])
def test_a_dark_room_beside_a_lit_one_stays_dark(gather):
    lit, dark = brightness_of_rooms(gather=gather)
    assert lit.min() > 0.1 and dark.max() <= 1e-4 * lit.mean()


def test_the_wall_is_found_by_lines_of_sight(monkeypatch):
    """Without them light leaks: the test before can fail."""
    join = PatchFinder._join
    monkeypatch.setattr(PatchFinder, "_join", lambda self, *arguments: join(self, *arguments[:-1], last=True))
    lit, dark = brightness_of_rooms()
    assert dark.max() > 1e-3 * lit.mean()


def test_a_wall_cuts_a_cell_in_two():
    """On either side of a thin wall the floor is another patch, and each sees its leader."""
    snapshot, grid = two_rooms()
    stages = Stages(snapshot, grid, BakeSettings(keep_all=True))
    hits, patch = stages.hits(), stages.patch().ravel()
    bound = patch >= 0
    side = np.sign(hits[:, 0])
    leader_side = np.sign(stages.points[np.maximum(patch, 0), 0, 0])
    np.testing.assert_array_equal(side[bound], leader_side[bound])
    cell = stages.light.patches.cell
    assert cell > 0.2, "cells are wider than the wall"
    floor = bound & (hits[:, 2] < -1.49) & (np.abs(hits[:, 0]) < cell)
    assert (side[floor] > 0).any() and (side[floor] < 0).any()


# Surfaces that no probe sees
# ----------------------------------------------------------------------------------------------------------------------


def corridor_with_lamp(position):
    """Probes in the first arm of a light grey corridor and a lamp elsewhere."""
    lamp = Light("lamp", "POINT", (20.0, 20.0, 20.0), frame(position))
    snapshot = snapshot_of(corridor(), materials=[Material("light grey", (0.8, 0.8, 0.8))], lights=[lamp])
    return snapshot, Grid.from_bounds([0.2, 0.2, 0.2], [2.4, 0.8, 0.8], (4, 2, 2))


@pytest.mark.any_version
def test_a_lamp_round_the_corner():
    """Most of the light comes by walls of the next arm that no probe sees. Against paths of two segments, which meet
    the lamp's light there themselves; patches stand for the mean of their light."""
    snapshot, grid = corridor_with_lamp((3.5, 2.8, 0.5))
    found, paths = (bake(snapshot, grid, BakeSettings(keep_all=True, gather=g, samples=1 + 3 * g)) for g in (0, 2))
    assert found.converged and paths.converged
    mean, expected = (irradiance_at_nodes(result.field).mean(axis=1) for result in (found, paths))
    np.testing.assert_allclose(mean, expected, rtol=0.1)
    assert mean.sum() == pytest.approx(expected.sum(), rel=0.05)


def test_a_lamp_round_two_corners():
    """All that probes see is in the shade, and its first light comes with the second bounce: that is no end of the
    bake. Mean radiance at the four nodes along the first edge by path tracing of 150 000 paths each, in float64 with
    every ray against every triangle: 0.049 ± 0.004, 0.073 ± 0.005, 0.114 ± 0.006, 0.211 ± 0.008."""
    snapshot, grid = corridor_with_lamp((1.0, 3.5, 0.6))
    assert not Stages(snapshot, grid, BakeSettings(keep_all=True)).direct().any()
    result = bake(snapshot, grid, BakeSettings(keep_all=True))
    assert result.converged and result.iterations > 5
    mean = Y00 * result.field.coefficients[:4, 0, 0]
    np.testing.assert_allclose(mean, [0.049, 0.073, 0.114, 0.211], rtol=0.2)


# Probes that move, memory that is short
# ----------------------------------------------------------------------------------------------------------------------


def room_with_a_thick_wall():
    """Nodes of the grid's middle plane stand in the wall."""
    parts = [box((-2, -1.5, -1.2), (2, 1.5, 1.2))[:, ::-1], box((-0.15, -1.6, -1.3), (0.2, 0.4, 1.3))]
    lamps = [Light("lamp", "POINT", (3.0, 3.0, 3.0), frame((x, -0.3, 0.7))) for x in (-1.1, 1.2)]
    objects = np.repeat([0, 1], 12)
    grey = Material("grey", (0.5, 0.5, 0.5))
    snapshot = snapshot_of(np.concatenate(parts), materials=[grey], objects=objects, lights=lamps)
    return snapshot, Grid.from_bounds([-1.6, -1.1, -0.8], [1.6, 1.1, 0.8], (3, 3, 2))


@pytest.mark.any_version
def test_a_moved_probe_is_a_probe_of_its_new_place():
    snapshot, grid = room_with_a_thick_wall()
    field = bake(snapshot, grid, BakeSettings(keep_all=True)).field
    moved = np.flatnonzero(field.offset.any(axis=1))
    assert len(moved) >= 2
    for node in moved[:2]:
        place = grid.positions()[node] + field.offset[node]
        there = Grid.from_bounds(place - 0.4, place + 0.4, (1, 1, 1))
        alone = bake(snapshot, there, BakeSettings(keep_all=True)).field
        np.testing.assert_allclose(
            field.coefficients[node], alone.coefficients[0], atol=0.02 * alone.coefficients[0, 0].max()
        )


@pytest.mark.any_version
@pytest.mark.parametrize("capture", [pytest.param("trace", marks=pytest.mark.nightly), "raster"])
def test_a_small_memory_budget(capture):
    """Texel surfaces that do not fit are captured again whenever they are needed, and give the same bytes."""
    grid = Grid.from_bounds([-0.91, -0.88, -0.93], [0.92, 0.89, 0.87], (5, 5, 7))
    lamp = Light("lamp", "POINT", (1.0, 2.0, 3.0), frame((0.3, 0.2, 0.5)))
    grey = snapshot_of(box()[:, ::-1], materials=[Material("grey", (0.5, 0.5, 0.5))], lights=[lamp])
    settings = BakeSettings(capture=capture, keep_all=True, bounces=2, face=32)  # 85 probes are bound at once
    small = replace(settings, memory_mib=16)
    note = "memory budget"
    result = bake(furnace(0.5), grid, small)
    assert any(note in text for text in result.notes)
    np.testing.assert_allclose(irradiance_at_nodes(result.field), series(0.5, 2), rtol=5e-6)
    large, small = bake(grey, grid, settings), bake(grey, grid, small)
    assert not any(note in text for text in large.notes)
    np.testing.assert_array_equal(small.field.state, large.field.state)
    np.testing.assert_array_equal(small.field.coefficients, large.field.coefficients)
