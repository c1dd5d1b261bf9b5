# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole bakes against closed forms and against themselves: furnaces, uniform worlds, both captures, moved and scaled
scenes."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.session import BakeSession
from gridlight.core.cubemap import unpack_normal
from gridlight.core.grid import Grid
from gridlight.core.settings import BakeSettings
from gridlight.core.snapshot import Light, Material, World
from gridlight.core.steps import run
from small_scenes import (
    AXES,
    Silent,
    all_lights,
    bake,
    box,
    cluttered_room,
    frame,
    furnace,
    irradiance_at_nodes,
    moved,
    snapshot_of,
)
from stages import Stages

NORMALS = np.concatenate([AXES, [[0.577350269, 0.577350269, -0.577350269], [-0.6, 0, 0.8]]])


def room_grid(resolution=(4, 4, 4)):
    return Grid.from_bounds([-0.9] * 3, [0.9] * 3, resolution)


def relative_rms(found, expected):
    return np.sqrt(((found - expected) ** 2).mean() / (expected**2).mean())


# Closed forms
# -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("capture", ["raster", "trace"])
@pytest.mark.parametrize("inward", [False, True], ids=["normals outward", "normals inward"])
@pytest.mark.parametrize(
    "albedo,tolerance",
    [
        (0.0, 5e-3),
        pytest.param(0.5, 5e-3, marks=pytest.mark.any_version),
        (0.9, 5e-3),
        pytest.param(0.99, 2e-2, marks=pytest.mark.any_version),
    ],
)
def test_furnace(albedo, tolerance, inward, capture):
    """Radiance 1 / (1 − a) everywhere, at every node for every normal, with the number of bounces chosen by the
    program."""
    result = bake(furnace(albedo, inward=inward), room_grid(), BakeSettings(capture=capture))
    assert result.converged
    assert result.counts == {"total": 64, "active": 64, "culled": 0, "invalid": 0}
    np.testing.assert_allclose(irradiance_at_nodes(result.field, NORMALS) * (1 - albedo), 1, atol=tolerance)


@pytest.mark.parametrize("bands", [1, 2, 4])
def test_furnace_with_other_bands(bands):
    result = bake(furnace(0.9), room_grid((3, 3, 3)), BakeSettings(bands=bands))
    np.testing.assert_allclose(irradiance_at_nodes(result.field, NORMALS) * 0.1, 1, atol=5e-3)


@pytest.mark.parametrize("face", [4, 5, 32])
def test_furnace_with_other_faces(face):
    result = bake(furnace(0.9), room_grid((3, 3, 3)), BakeSettings(face=face))
    np.testing.assert_allclose(irradiance_at_nodes(result.field, NORMALS) * 0.1, 1, atol=2e-2 if face < 8 else 5e-3)


@pytest.mark.any_version
def test_a_furnace_that_loses_nothing_never_settles():
    result = bake(furnace(1.0), room_grid((2, 2, 2)), BakeSettings(face=4))
    assert not result.converged
    assert any("not converged" in note and "base colour" in note for note in result.notes)


@pytest.mark.parametrize("capture", ["raster", "trace"])
def test_uniform_world_is_exact(capture):
    """Nothing in reach: every probe has exactly the world's radiance, whether all are kept or none is needed but the
    nearest."""
    world = World((0.2, 0.5, 1.0))
    snapshot = snapshot_of(box((-1, -1, 5000), (1, 1, 5002)), world=world)
    for keep_all in (True, False):
        result = bake(snapshot, room_grid(), BakeSettings(capture=capture, keep_all=keep_all))
        np.testing.assert_allclose(
            irradiance_at_nodes(result.field, NORMALS), np.tile(world.color, (64, len(NORMALS), 1)), rtol=1e-5
        )
        assert result.converged


def test_no_light_is_black_and_says_so():
    result = bake(snapshot_of(box()), room_grid((2, 2, 2)), BakeSettings())
    assert (result.field.coefficients == 0).all() and result.converged
    assert any("no light" in warning for warning in result.warnings)


def floor_irradiance(light, samples=1, **settings):
    """(X, 3) points of a large floor one metre below one probe, as its texels within 5 m see them, and (X, 3)
    irradiance there."""
    floor = [[[-50, -50, -1], [50, -50, -1], [50, 50, -1]], [[-50, -50, -1], [50, 50, -1], [-50, 50, -1]]]
    snapshot = snapshot_of(floor, materials=[Material("white", (1.0, 1.0, 1.0))], lights=[light])
    stages = Stages(
        snapshot, Grid.from_bounds([-0.1] * 3, [0.1] * 3, (1, 1, 1)), BakeSettings(keep_all=True, **settings)
    )
    hits = stages.hits()
    near = (hits[:, 3] >= 0) & (np.abs(hits[:, :3]).max(axis=1) < 5)
    assert near.sum() > 100
    return hits[near, :3] + stages.grid.center, stages.irradiance_at_texels(samples)[0][near]


def test_point_light_above_a_plane():
    light = Light("lamp", "POINT", (7.0, 5.0, 3.0), frame((0.5, 0.3, 1.0)))
    points, found = floor_irradiance(light)
    offset = np.array([0.5, 0.3, 1.0]) - points
    expected = 2.0 / np.linalg.norm(offset, axis=1) ** 3
    np.testing.assert_allclose(found, expected[:, None] * [7.0, 5.0, 3.0], rtol=2e-5)


@pytest.mark.parametrize("angle", [0.0, 0.00918, 0.5])
def test_sun_above_a_plane(angle):
    light = Light("sun", "SUN", (3.0, 3.0, 3.0), frame(towards=(0.6, 0, -0.8)), angle=angle)
    _points, found = floor_irradiance(light, 256 if angle else 1)
    np.testing.assert_allclose(found, 3 * 0.8, rtol=1e-5 if angle == 0 else 5e-3)


def test_area_light_above_a_plane_against_its_form_factor():
    """E = π L F of the floor below a parallel rectangle: four rectangles with a corner above the point (Howell, B-4),
    with sign."""
    light = Light(
        "panel", "AREA", (2.0, 2.0, 2.0), np.eye(4) + np.outer([0, 0, 2, 0], [0, 0, 0, 1]), size_x=2.0, size_y=1.0
    )
    points, found = floor_irradiance(light, 512)

    def corner(width, depth, height=3.0):
        a, b = width / height, depth / height
        ra, rb = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
        return (a / ra * np.arctan(b / ra) + b / rb * np.arctan(a / rb)) / (2 * np.pi)

    x, y = points[:, 0], points[:, 1]
    factor = sum(corner(1.0 + sx * x, 0.5 + sy * y) for sx in (-1, 1) for sy in (-1, 1))
    np.testing.assert_allclose(found, np.tile(2 * np.pi * factor[:, None], 3), rtol=1e-2)
    np.testing.assert_allclose(found.sum(axis=0), 2 * np.pi * factor.sum(), rtol=1e-3)


def ground(size, rotation=np.eye(3)):
    """Two triangles, ``size`` metres to each side, one metre below the origin, not quite square."""
    corners = size * np.array([[[-1, -1, 0], [1, -1.1, 0], [1, 1, 0]], [[-1, -1, 0], [1, 1, 0], [-1, 1, 0]]])
    return (corners - [0.01 * size, 0.02 * size, 1.0]) @ rotation.T


@pytest.mark.parametrize("capture", ["trace", "raster"])
@pytest.mark.parametrize("size", [10.0, 1e3, 1e4, 1e5])
@pytest.mark.parametrize("slanted", [False, True])
def test_a_ground_plane_does_not_shadow_itself(size, slanted, capture):
    """Corners kilometres away are rounded to centimetres in float32: hits must stay on the plane and rays must not
    meet it again."""
    rotation = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0] if slanted else np.eye(3)
    rotation *= np.linalg.det(rotation)
    sun = Light("sun", "SUN", (3.0, 3.0, 3.0), frame(towards=rotation @ [0.6, 0, -0.8]))
    snapshot = snapshot_of(ground(size, rotation), materials=[Material("white", (1.0, 1.0, 1.0))], lights=[sun])
    stages = Stages(snapshot, Grid.from_bounds([-0.1] * 3, [0.1] * 3, (1, 1, 1)), BakeSettings(keep_all=True), capture)
    direct = stages.direct()
    assert len(direct) > 100 and (stages.patch() >= 0).sum() > 500
    # normals of patches are rounded to steps of 1/2047
    assert (np.abs(direct / 2.4 - 1).max(axis=1) < (5e-4 if slanted else 1e-5)).mean() > 0.995


def test_the_probe_above_a_lit_plane():
    """Sun on an endless white floor: radiance L = E/π from below only. Three bands of that half sphere, exactly: the
    clamped cosine's A₀Y₀₀ + A₁ + A₂ against the projection of a step, ∫₋₁⁰ P_l: 1, −½, 0 times 2π, so E(n) = π L (½ −
    ½ n_z)."""
    sun = Light("sun", "SUN", (3.0, 3.0, 3.0), frame(towards=(0, 0, -1)))
    snapshot = snapshot_of(ground(1e4), materials=[Material("white", (1.0, 1.0, 1.0))], lights=[sun])
    grid = Grid.from_bounds([-0.5] * 3, [0.5] * 3, (2, 2, 2))
    found = irradiance_at_nodes(bake(snapshot, grid, BakeSettings(face=32, keep_all=True)).field, NORMALS)
    expected = 3 / np.pi * (0.5 - 0.5 * NORMALS[:, 2])
    np.testing.assert_allclose(found, np.broadcast_to(expected[None, :, None], found.shape), atol=5e-3)


# Two captures, one result
# -------------------------------------------------------------------------------------------------


def pillars(seed=0):
    """A hall with boxes standing in it."""
    generator = np.random.default_rng(seed)
    parts = [box((-2, -2, -1), (2, 2, 1))[:, ::-1]]
    for _ in range(12):
        x, y = generator.uniform(-1.8, 1.8, 2)
        parts.append(box((x - 0.1, y - 0.12, -1), (x + 0.13, y + 0.1, generator.uniform(-0.5, 0.9))))
    objects = np.repeat(np.arange(13), 12)
    material = np.where(objects == 0, 0, 1 + objects % 2)
    lamp = Light("lamp", "POINT", (5.0, 4.0, 3.0), frame((0.31, 0.47, 0.7)))
    return snapshot_of(
        np.concatenate(parts),
        material,
        [Material("wall", (0.6, 0.6, 0.6)), Material("red", (0.7, 0.1, 0.1)), Material("blue", (0.1, 0.1, 0.7))],
        objects,
        lights=[lamp],
    )


def soup(count=2000, seed=1):
    """Thousands of triangles in the open, more than one cluster of the layered pass."""
    generator = np.random.default_rng(seed)
    corners = generator.uniform(-2, 2, (count, 1, 3)) + generator.normal(0, 0.05, (count, 3, 3))
    return snapshot_of(corners, world=World((1.0, 0.8, 0.6)))


SCENES = {
    "cluttered room": (cluttered_room, (-0.6, -0.5, -0.5), (0.7, 0.5, 0.4)),
    "pillars": (pillars, (-1.7, -1.6, -0.8), (1.6, 1.7, 0.8)),
    "soup": (soup, (-1.5, -1.5, -1.5), (1.4, 1.4, 1.4)),
    "furnace": (lambda: furnace(0.5), (-0.81, -0.83, -0.77), (0.84, 0.79, 0.82)),
}


@pytest.mark.parametrize("name", SCENES)
def test_captures_agree(name):
    build, low, high = SCENES[name]
    grid = Grid.from_bounds(low, high, (4, 3, 3))
    stages = Stages(build(), grid, BakeSettings(face=16, keep_all=True))
    traced = stages.surfaces()
    stages.capture("raster")
    drawn = stages.surfaces()
    same = traced.triangle == drawn.triangle
    both = np.isfinite(traced.distance) & np.isfinite(drawn.distance)
    one, other = (np.where(both, seen.distance, 1.0) for seen in (traced, drawn))
    near = (np.abs(one - other) < 1e-3 * one) & (np.isfinite(traced.distance) == np.isfinite(drawn.distance))
    assert (same & near).mean() >= 0.995
    # The rest lies on edges: the reference's ray through the texel's centre, moved a little, finds both triangles.
    probe, texel = np.nonzero(~same)
    for p, x in list(zip(probe, texel))[:20]:
        assert on_an_edge(stages.reference, p, x, traced.triangle[p, x]) or on_an_edge(
            stages.reference, p, x, drawn.triangle[p, x]
        )


def on_an_edge(reference, probe, texel, triangle):
    """Does the texel's ray pass close to an edge of ``triangle``, in angle?"""
    if triangle < 0:
        return False
    corners = reference.scene.triangles[triangle] - reference.positions[probe]
    corners /= np.linalg.norm(corners, axis=1, keepdims=True)
    direction = reference.directions[texel]
    steps = np.linspace(0, 1, 2001)[:, None]
    edges = np.concatenate([a * steps + b * (1 - steps) for a, b in zip(corners, np.roll(corners, 1, axis=0))])
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    return bool((edges @ direction).max() > np.cos(2e-3))


@pytest.mark.any_version
@pytest.mark.parametrize("name", SCENES)
def test_captures_give_the_same_light(name):
    build, low, high = SCENES[name]
    grid = Grid.from_bounds(low, high, (4, 3, 3))
    fields = [bake(build(), grid, BakeSettings(capture=capture, bounces=2)).field for capture in ("trace", "raster")]
    np.testing.assert_array_equal(fields[0].state, fields[1].state)
    found, expected = (irradiance_at_nodes(field) for field in fields)
    # A few patches more or less, and all draw other numbers: the two are as far apart as two seeds.
    assert relative_rms(found, expected) < 1.2e-2
    assert np.abs(found - expected).max() < 1e-2 * expected.max()


@pytest.mark.parametrize("capture", ["trace", "raster"])
def test_two_runs_give_identical_bytes(capture):
    grid = Grid.from_bounds([-0.6, -0.5, -0.5], [0.7, 0.5, 0.4], (3, 3, 3))
    runs = [bake(lamps_of_three_kinds(), grid, BakeSettings(capture=capture)).field for _ in range(2)]
    for name in ("coefficients", "state", "validity", "depth"):
        assert getattr(runs[0], name).tobytes() == getattr(runs[1], name).tobytes(), name


def lamps_of_three_kinds():
    return cluttered_room({name: all_lights()[name] for name in ("point soft", "sun wide", "ellipse")}, clutter=12)


@pytest.mark.any_version
def test_another_seed_gives_other_bytes_but_the_same_light():
    grid = Grid.from_bounds([-0.6, -0.5, -0.5], [0.7, 0.5, 0.4], (3, 3, 3))
    one, two = (bake(lamps_of_three_kinds(), grid, BakeSettings(seed=seed)).field for seed in (0, 1))
    assert one.coefficients.tobytes() != two.coefficients.tobytes()
    assert relative_rms(irradiance_at_nodes(one), irradiance_at_nodes(two)) < 1e-2


# Invariance
# ---------------------------------------------------------------------------------------------------------------


@pytest.mark.any_version
def test_far_from_the_origin():
    """The same room 100 km away in every direction, and as far as 1000 km, where float64 still has 1e-10 m."""
    grid = Grid.from_bounds([-0.9] * 3, [0.9] * 3, (4, 4, 4))
    expected = irradiance_at_nodes(bake(pillars(), grid, BakeSettings()).field)
    for distance in (1e5, 1e6):
        away = np.eye(4)
        away[:3, 3] = (distance, -distance, distance)
        there = Grid(away @ grid.matrix, grid.resolution)
        found = irradiance_at_nodes(bake(moved(pillars(), away), there, BakeSettings()).field)
        assert relative_rms(found, expected) < 5e-3


@pytest.mark.any_version
@pytest.mark.parametrize("scale", [0.01, 1000.0])
@pytest.mark.parametrize("capture", ["trace", "raster"])
def test_scale(scale, capture):
    """A room of 4 cm or 4 km: with a point light E goes with 1/scale²; the sun and emission stay."""
    grid = Grid.from_bounds([-1.7, -1.6, -0.8], [1.6, 1.7, 0.8], (4, 3, 3))
    shrink = np.diag([scale, scale, scale, 1.0])
    snapshot = moved(pillars(), shrink)
    lamp = snapshot.lights[0]
    snapshot = replace(snapshot, lights=[replace(lamp, color=tuple(scale**2 * np.array(lamp.color)))])
    expected = irradiance_at_nodes(bake(pillars(), grid, BakeSettings(capture=capture)).field)
    result = bake(snapshot, Grid(shrink @ grid.matrix, grid.resolution), BakeSettings(capture=capture))
    assert result.counts["active"] > 20
    assert relative_rms(irradiance_at_nodes(result.field), expected) < 5e-3


@pytest.mark.any_version
def test_a_rotated_volume_is_a_rotated_scene():
    """Cubemaps and depth maps stay aligned with the world: what is left is their different sampling of the scene."""
    rotation, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    rotation *= np.linalg.det(rotation)
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = rotation, (3, 4, 5)
    grid = room_grid((3, 3, 3))
    settings = BakeSettings(face=32)
    straight, turned = (
        bake(pillars(), grid, settings),
        bake(moved(pillars(), turn), Grid(turn @ grid.matrix, grid.resolution), settings),
    )
    assert (straight.field.state == turned.field.state).all()
    expected = irradiance_at_nodes(straight.field, NORMALS)
    found = irradiance_at_nodes(turned.field, NORMALS @ rotation.T)
    assert relative_rms(found, expected) < 1.5e-2


@pytest.mark.any_version
def test_twice_the_light_is_twice_the_field():
    grid = room_grid((3, 3, 3))
    snapshot = pillars()
    lamp = snapshot.lights[0]
    one = bake(snapshot, grid, BakeSettings(bounces=4)).field.coefficients
    two = bake(
        replace(snapshot, lights=[replace(lamp, color=tuple(2 * np.array(lamp.color)))]), grid, BakeSettings(bounces=4)
    ).field.coefficients
    np.testing.assert_allclose(two, 2 * one, rtol=1e-5, atol=1e-6)


@pytest.mark.any_version
def test_light_adds_up():
    """A bake with two lamps is the sum of bakes with one each."""
    grid = room_grid((3, 3, 3))
    snapshot = pillars()
    lamps = [snapshot.lights[0], Light("other", "POINT", (1.0, 2.0, 3.0), frame((-0.9, -0.7, 0.6)))]
    fields = [
        bake(replace(snapshot, lights=chosen), grid, BakeSettings(bounces=3)).field.coefficients
        for chosen in (lamps, lamps[:1], lamps[1:])
    ]
    # how many samples a patch takes depends on how uneven its light is: all that is left between the two
    np.testing.assert_allclose(fields[0], fields[1] + fields[2], atol=2e-3 * np.abs(fields[0]).max())


@pytest.mark.any_version
def test_what_only_buried_probes_see_does_not_hold_up_the_rest():
    """A hollow of white walls keeps light for very long; probes inside it are invalid, so nobody waits for that."""
    wall, hollow = box((-3, -3, -3), (3, 3, 3))[:, ::-1], box((-1, -1, -1), (1, 1, 1))
    corners = np.concatenate([wall, hollow])
    objects = np.repeat([0, 1], 12)
    materials = [Material("grey", (0.5,) * 3), Material("white", (1.0,) * 3)]
    lamp = Light("lamp", "POINT", (5.0,) * 3, frame((0.1, 0.2, 2.5)))
    snapshot = snapshot_of(corners, objects, materials, objects, lights=[lamp])
    job = BakeJob(snapshot, Grid.from_bounds([-2.5] * 3, [2.5] * 3, (9, 9, 9)), BakeSettings(face=8))
    session = BakeSession(job, Silent())
    run(session.bake())
    assert session.result.counts["invalid"] > 0 and session.result.converged
    patches = session.backend.light.patches
    leaders = patches.read_points()[:, 0].astype(float)
    inside = (np.abs(leaders[:, :3] + 1e-3 * unpack_normal(leaders[:, 3])) < 1).all(axis=1)
    seen = patches.read_seen()
    assert inside.sum() > 100 and not seen[inside].any() and seen[~inside].mean() > 0.9
