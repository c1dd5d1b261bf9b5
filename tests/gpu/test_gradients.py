# SPDX-License-Identifier: GPL-3.0-or-later
"""Gradients of probes on the GPU: against the reference, and against the bake itself with its probes moved."""

import numpy as np
import pytest
from gridlight.core import gradients
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material, World
from small_scenes import all_lights, bake, box, cluttered_room, frame, snapshot_of
from stages import Stages

GRID = Grid.from_bounds([-0.6, -0.5, -0.5], [0.7, 0.5, 0.4], (3, 2, 2))


def lamps_and_box():
    """A closed room with a box in it and two small panels that glow, on either side."""
    square = np.array([[[-1, -1, 0], [1, 1, 0], [1, -1, 0]], [[-1, -1, 0], [-1, 1, 0], [1, 1, 0]]], float)
    parts = [
        box((-1.3, -1.2, -1.0), (1.2, 1.3, 1.1))[:, ::-1],
        box((0.1, 0.2, -1.0), (0.5, 0.6, -0.1)),
        square * [0.3, 0.2, 1] + [0.1, -0.1, 1.05],
        square[..., [2, 0, 1]] * [1, 0.1, 0.2] + [-1.25, 0.3, 0.2],
    ]
    index = np.repeat([0, 1, 2, 3], [12, 12, 2, 2])
    materials = [
        Material("wall", (0.6, 0.5, 0.4)),
        Material("box", (0.2, 0.3, 0.8)),
        Material("white lamp", (0.0, 0.0, 0.0), emission=(6.0, 5.0, 4.0)),
        Material("green lamp", (0.5, 0.5, 0.5), emission=(0.5, 4.0, 0.5)),
    ]
    return snapshot_of(np.concatenate(parts), index, materials, index)


def lit(snapshot, **settings):
    """Stages after one bounce."""
    stages = Stages(snapshot, GRID, BakeSettings(face=8, keep_all=True, seed=5, **settings))
    stages.direct()
    stages.connect()
    irradiance = stages.iterate(True)[0]
    stages.backend.find_emission(
        stages.gpu, np.arange(stages.gpu.count)
    ) if stages.backend.scene.emitter_count else None
    stages.project()
    surfaces = stages.surfaces()
    expected = stages.reference.gradient(surfaces, stages.reference.reflected(surfaces, stages.patch(), irradiance))
    return stages, expected


@pytest.mark.parametrize(
    "bands", [pytest.param(1, marks=pytest.mark.any_version), pytest.param(2, marks=pytest.mark.any_version), 4]
)
def test_edges_between_texels_against_the_reference(gpu_context, bands):
    """A room with textures, holes, a sky and things flying about, some of them seen from inside."""
    stages, expected = lit(cluttered_room({"point": all_lights()["point"]}), bands=bands)
    found = stages.backend.read_gradient()
    assert found.shape == expected.shape == (GRID.count, 3, gradients.gradient_bands(bands) ** 2, 3)
    assert np.abs(expected).max() > 0.3
    np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_sampled_emitters_against_the_reference(gpu_context):
    """Texels and points: near the box the lamps' light ends at its rim. A running sum chooses which points get rays, so
    rounding may choose the next one."""
    stages, expected = lit(lamps_and_box(), bands=3)
    assert stages.backend.scene.emitter_count == 4
    found = stages.backend.read_gradient()
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())
    stages.backend.forget_emission()
    stages.project()
    without = stages.backend.read_gradient()
    assert np.abs(found - without).max() > 0.3 * np.abs(expected).max()


def moved_bakes(snapshot, grid, settings, step):
    """(P, 2, K, 3) central differences of the bake with its volume moved by ``step`` metres each way, along X and
    Z."""
    result = []
    for axis in np.eye(3)[[0, 2]]:
        ahead, behind = (
            bake(snapshot, Grid(moved(grid.matrix, sign * step * axis), grid.resolution), settings).field.coefficients
            for sign in (1, -1)
        )
        result.append((ahead.astype(float) - behind) / (2 * step))
    return np.stack(result, axis=1)


def moved(matrix, offset):
    matrix = matrix.copy()
    matrix[:3, 3] += offset
    return matrix


ROOMS = {
    "spot": (
        [box((-1.3, -1.2, -1.0), (1.2, 1.3, 1.1))[:, ::-1], box((0.75, 0.8, -1.0), (1.1, 1.15, 0.1))],
        [Light("spot", "SPOT", (9.0, 8.0, 7.0), frame((0.1, 0.2, 1.0), (-0.3, 0.2, -1)), spot_size=1.2)],
        World(),
    ),
    "outdoors": (
        [box((-30, -30, -1.2), (30, 30, -1.0)), box((-0.9, 0.7, -1.0), (0.1, 1.5, 0.6))],
        [Light("sun", "SUN", (3.0, 2.8, 2.5), frame(towards=(0.4, 0.5, -0.7)))],
        World((0.4, 0.6, 1.0)),
    ),
}


@pytest.mark.any_version
@pytest.mark.parametrize("room, most", [pytest.param("spot", 0.1, marks=pytest.mark.nightly), ("outdoors", 0.2)])
def test_gradients_are_what_the_bake_changes_by(gpu_context, room, most):
    """Walls are 0.5 m and more from probes, so nothing is too near. Texels have 4°, what light does within one only the
    differences know. Outdoors the horizon, where the ground ends within a texel, is most of the error."""
    parts, lights, world = ROOMS[room]
    index = np.repeat(np.arange(len(parts)), 12)
    snapshot = snapshot_of(
        np.concatenate(parts), None, [Material("grey", (0.6, 0.5, 0.4))], index, lights=lights, world=world
    )
    grid = Grid.from_bounds([-0.6, -0.2, -0.3], [0.7, 0.2, 0.3], (3, 1, 1))
    settings = BakeSettings(face=24, samples=2, bounces=1, keep_all=True)
    expected = moved_bakes(snapshot, grid, settings, 0.06)
    found = bake(snapshot, grid, settings).field.gradient[:, [0, 2]]
    error = np.sqrt(((found - expected) ** 2).sum() / (expected**2).sum())
    assert error < most


def test_probes_without_light_of_their_own_have_no_gradient(gpu_context):
    """Those inside the box, and culled ones that nothing was captured for."""
    parts = [box((-2, -2, -2), (2, 2, 2))[:, ::-1], box((-0.5, -0.5, -0.5), (0.6, 0.6, 0.6))]
    lamp = Light("point", "POINT", (3.0, 2.0, 1.0), frame((1.2, 1.3, 1.4)))
    snapshot = snapshot_of(np.concatenate(parts), None, (), np.repeat([0, 1], 12), lights=[lamp])
    field = bake(snapshot, Grid.from_bounds([-1.6] * 3, [1.6] * 3, (9, 9, 9)), BakeSettings(face=6)).field
    assert (np.bincount(field.state, minlength=3) > 0).all()
    assert (~field.holds_light).any() and not field.gradient[~field.holds_light].any()
    assert field.gradient[field.holds_light].any(axis=(1, 2, 3)).all()
    change = np.abs(gradients.per_cell(field.grid, field.gradient[:, :, :1])).sum(axis=(1, 2))
    assert (change <= 2.0001 * field.coefficients[:, 0]).all()
