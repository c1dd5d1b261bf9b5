# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference bake itself against closed forms, so that what the GPU is compared with is right."""

import numpy as np
import pytest
from gridlight.core import lookup
from gridlight.core.grid import Grid
from gridlight.core.panorama import panorama_directions, panorama_solid_angles
from gridlight.core.reference_bake import ReferenceBake, bake
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Image, Light, Material, SceneSnapshot, World

NORMALS = np.concatenate([np.eye(3), -np.eye(3)])


def room(material, lights=(), world=World(), images=(), half=1.0, inward=False):
    """A cube of 2·half metres with outward normals, or inward."""
    corners = half * np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    uvs = np.concatenate([np.tile([[0, 0], [1, 0], [1, 1]], (6, 1, 1)), np.tile([[0, 0], [1, 1], [0, 1]], (6, 1, 1))])
    if inward:
        triangles, uvs = triangles[:, ::-1].copy(), uvs[:, ::-1].copy()
    edge = corners[triangles][:, 1:] - corners[triangles][:, :1]
    normal = np.cross(edge[:, 0], edge[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    zeros = np.zeros(12, np.int32)
    return SceneSnapshot(
        corners,
        triangles,
        np.repeat(normal[:, None], 3, axis=1).astype(np.float32),
        uvs.astype(np.float32),
        zeros,
        zeros,
        ["room"],
        [material],
        list(images),
        list(lights),
        world,
    )


def irradiance_at_nodes(field):
    points = np.repeat(field.grid.positions(), 6, axis=0)
    return lookup.irradiance(field, points, np.tile(NORMALS, (field.grid.count, 1)))


GRID = Grid.from_bounds([-0.8, -0.79, -0.81], [0.8, 0.78, 0.77], (2, 2, 3))
FEW = Grid.from_bounds([-0.8, -0.79, -0.81], [0.8, 0.78, 0.77], (2, 1, 1))


ONCE = pytest.mark.any_version


@pytest.mark.parametrize(
    "albedo,bounces,gather,inward",
    [
        pytest.param(0.0, 0, 0, False, marks=ONCE),
        pytest.param(0.5, 14, 0, False, marks=ONCE),
        pytest.param(0.5, 2, 0, True, marks=ONCE),
        (0.7, 1, 2, False),
        pytest.param(0.7, 1, 2, True, marks=ONCE),
    ],
)
def test_furnace(albedo, bounces, gather, inward):
    """Emission 1 and albedo a: radiance Σ aⁱ, whichever way the normals point; a gather adds its segments."""
    snapshot = room(Material("m", (albedo,) * 3, emission=(1.0, 1.0, 1.0)), inward=inward)
    field = bake(snapshot, FEW, BakeSettings(bounces=bounces, face=4, gather=gather))
    assert (field.state == 1).all()
    expected = np.pi * sum(albedo**i for i in range(bounces + gather + 1))
    np.testing.assert_allclose(irradiance_at_nodes(field), expected, rtol=1e-9)


def test_uniform_world_and_nothing_in_reach():
    snapshot = room(Material("m"), world=World((0.2, 0.5, 1.0)))
    grid = Grid.from_bounds([499] * 3, [501] * 3, (2, 2, 2))
    field = bake(snapshot, grid, BakeSettings(bounces=1, face=16, keep_all=True))
    np.testing.assert_allclose(irradiance_at_nodes(field) / np.pi, np.tile([0.2, 0.5, 1.0], (48, 1)), rtol=1e-3)


def test_a_point_light_in_a_room_by_hand():
    """Every patch gets the mean of I cos θ / d² over its points, and texels reflect albedo/π of that."""
    position = np.array([0.3, -0.2, 0.1])
    matrix = np.eye(4)
    matrix[:3, 3] = position
    snapshot = room(Material("m", (0.5, 0.25, 1.0)), [Light("lamp", "POINT", (1.0, 1.0, 2.0), matrix)])
    job = ReferenceBake(snapshot, GRID, BakeSettings(face=6))
    surfaces = job.capture()
    assert np.abs(job.points(surfaces) + GRID.center).max(axis=2) == pytest.approx(1, rel=1e-12), "a wall everywhere"
    patch = job.bind(surfaces)
    job.light.light_new_patches()
    points = job.light.patches.points[..., :3] + GRID.center
    normals = -np.sign(points) * (np.abs(points) > 1 - 1e-4)
    in_one_plane = (np.abs(normals).sum(axis=2) == 1).all(axis=1)
    assert in_one_plane.mean() > 0.95
    to_light = position - points
    expected = (np.einsum("npi,npi->np", to_light, normals) / np.linalg.norm(to_light, axis=2) ** 3).mean(axis=1)
    found = job.light.direct[in_one_plane]
    np.testing.assert_allclose(found, expected[in_one_plane, None] * [1.0, 1.0, 2.0], rtol=1e-4)
    reflected = job.reflected(surfaces, patch, job.light.direct)
    np.testing.assert_allclose(reflected, job.light.direct[patch] * np.array([0.5, 0.25, 1.0]) / np.pi, rtol=1e-12)


def test_a_sun_of_the_world_lights_like_a_lamp():
    """A floor under a black sky with one bright spot: E = ∫ L cos θ dω of the map, found without luck."""
    sky = np.zeros((64, 128, 3), np.float32)
    sky[45:47, 60:62] = 500.0
    directions, solid_angles = panorama_directions(128, 64), panorama_solid_angles(128, 64)
    expected = (sky[..., 0] * solid_angles * np.maximum(directions[..., 2], 0)).sum()
    assert expected > 0, "rows above the middle lie above the horizon"
    floor = np.array([[-50, -50, -1], [50, -50, -1], [50, 50, -1], [-50, 50, -1]], float)
    snapshot = SceneSnapshot(
        floor,
        np.array([[0, 1, 2], [0, 2, 3]], np.int32),
        np.tile(np.array([0, 0, 1], np.float32), (2, 3, 1)),
        np.zeros((2, 3, 2), np.float32),
        np.zeros(2, np.int32),
        np.zeros(2, np.int32),
        ["floor"],
        [Material("m")],
        [],
        [],
        World(map=sky),
    )
    job = ReferenceBake(snapshot, Grid.from_bounds([-0.5] * 3, [0.5] * 3, (1, 1, 1)), BakeSettings(face=6))
    job.bind(job.capture())
    job.light.light_new_patches()
    np.testing.assert_allclose(job.light.direct[:, 0], expected, rtol=0.02)


def test_textures_holes_and_emission():
    pixels = np.ones((2, 2, 4), np.float32)
    pixels[0, 0, :3] = (1, 0, 0)
    textured = room(Material("m", (0.5, 0.5, 0.5), base_image=0), images=[Image("i", pixels)])
    surfaces = ReferenceBake(textured, GRID, BakeSettings(face=6)).capture()
    assert surfaces.albedo[..., 0] == pytest.approx(0.5, abs=1e-3)
    assert 0 < surfaces.albedo[..., 1].min() < 0.499 and surfaces.albedo[..., 1].max() <= 0.5

    hole = np.ones((2, 2, 4), np.float32)
    hole[..., 3] = 0
    open_room = room(
        Material("m", alpha_image=0, alpha_threshold=0.5), images=[Image("i", hole)], world=World((1, 2, 3))
    )
    surfaces = ReferenceBake(open_room, GRID, BakeSettings(face=6)).capture()
    assert (surfaces.triangle == -1).all() and (surfaces.emission == [1, 2, 3]).all()


def test_probes_in_a_solid_are_invalid():
    """A small box in a room: the room's inward faces are seen by all, the box from outside by most and from inside by
    one."""
    outer, inner = room(Material("m"), inward=True), room(Material("m"), half=0.3)
    both = SceneSnapshot(
        np.concatenate([outer.vertices, inner.vertices]),
        np.concatenate([outer.triangles, inner.triangles + 8]),
        np.concatenate([outer.corner_normals, inner.corner_normals]),
        np.concatenate([outer.corner_uvs, inner.corner_uvs]),
        np.zeros(24, np.int32),
        np.repeat([0, 1], 12).astype(np.int32),
        ["room", "box"],
        [Material("m")],
        [],
        [Light("lamp", "POINT", (1.0, 1.0, 1.0), np.eye(4) + np.outer([0.5, 0.6, 0.7, 0], [0, 0, 0, 1]))],
        World(),
    )
    grid = Grid.from_bounds([-0.8] * 3, [0.8] * 3, (3, 3, 3))
    job = ReferenceBake(both, grid, BakeSettings(face=8))
    surfaces = job.capture()
    patch = job.bind(surfaces)
    job.light.light_new_patches()
    reflected = job.reflected(surfaces, patch, job.light.direct)
    assert not job.shells(surfaces, reflected).any()
    state = job.field_statistics(surfaces, reflected).state
    assert state[13] == 2 and (np.delete(state, 13) == 1).all()
