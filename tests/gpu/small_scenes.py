# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a few triangles as plain snapshots: furnaces, and a cluttered room with everything a bake must handle."""

from dataclasses import replace

import numpy as np
from gridlight.bake.bake_job import BakeJob
from gridlight.bake.job import run_bake
from gridlight.bake.result import Silent
from gridlight.core import lookup
from gridlight.core.light_profiles import DISTANCES_M, HEIGHT, WIDTH, LightProfile
from gridlight.core.panorama import panorama_directions
from gridlight.core.sampling import tangent_frame
from gridlight.core.snapshot import DITHERED, Image, Light, Material, SceneSnapshot, World

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def bake(snapshot, grid, settings):
    return run_bake(BakeJob(snapshot, grid, settings), Silent(), lambda: False)


def irradiance_at_nodes(field, normals=AXES):
    """(P, N, 3) irradiance over π at every node for every normal."""
    points = np.repeat(field.grid.positions(), len(normals), axis=0)
    found = lookup.irradiance(field, points, np.tile(normals, (field.grid.count, 1))) / np.pi
    return found.reshape(field.grid.count, len(normals), 3)


def snapshot_of(corners, material=None, materials=(), objects=None, uvs=None, **options):
    """A snapshot of loose triangles ``corners`` (T, 3, 3) with flat normals."""
    corners = np.asarray(corners, float)
    count = len(corners)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    objects = np.zeros(count, np.int32) if objects is None else np.asarray(objects, np.int32)
    return SceneSnapshot(
        vertices=corners.reshape(-1, 3),
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        corner_normals=np.repeat(normal[:, None], 3, axis=1).astype(np.float32),
        corner_uvs=np.zeros((count, 3, 2), np.float32) if uvs is None else np.asarray(uvs, np.float32),
        material_index=np.zeros(count, np.int32) if material is None else np.asarray(material, np.int32),
        object_index=objects,
        object_names=[f"object {i}" for i in range(int(objects.max(initial=0)) + 1)],
        materials=list(materials) or [Material("grey")],
        images=options.pop("images", []),
        lights=options.pop("lights", []),
        world=options.pop("world", World()),
        **options,
    )


def box(low=(-1, -1, -1), high=(1, 1, 1)):
    """(12, 3, 3) triangles whose normals point outwards."""
    x, y, z = np.stack([low, high], axis=1).astype(float)
    corners = np.array([[a, b, c] for c in z for b in y for a in x])
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    return corners[np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])]


def corridor():
    """(T, 3, 3) triangles of a closed corridor with a square section of 1 m and two corners, normals inwards: from
    x = 0 to 4 along y = 0..1, on to y = 4, and back along the far side to x = 0."""
    outline = np.array([(0, 0), (4, 0), (4, 4), (0, 4), (0, 3), (3, 3), (3, 1), (0, 1)], float)
    sides = []
    for (ax, ay), (bx, by) in zip(outline, np.roll(outline, -1, axis=0)):
        a, b, c, d = (ax, ay, 0), (bx, by, 0), (bx, by, 1), (ax, ay, 1)
        sides += [(a, c, b), (a, d, c)]
    squares = [(0, 0, 4, 1), (3, 1, 4, 3), (0, 3, 4, 4)]
    for x0, y0, x1, y1 in squares:
        a, b, c, d = (x0, y0), (x1, y0), (x1, y1), (x0, y1)
        sides += [tuple((*p, 0.0) for p in triangle) for triangle in ((a, b, c), (a, c, d))]
        sides += [tuple((*p, 1.0) for p in triangle) for triangle in ((a, c, b), (a, d, c))]
    return np.array(sides, float)


def furnace(albedo, emission=1.0, inward=False):
    """A closed cube, 2 m: radiance emission / (1 − albedo) everywhere."""
    corners = box()[:, ::-1] if inward else box()
    return snapshot_of(corners, materials=[Material("glowing", (albedo,) * 3, emission=(emission,) * 3)])


def frame(position=(0, 0, 0), towards=(0, 0, -1)):
    """(4, 4) matrix of a light at ``position`` that shines ``towards``."""
    back = -np.asarray(towards, float) / np.linalg.norm(towards)
    right, up = tangent_frame(back[None])
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right[0], up[0], back], axis=1)
    matrix[:3, 3] = position
    return matrix


def some_profile():
    """Bright below, dim and red above, fading more slowly than by the square."""
    z = panorama_directions(WIDTH, HEIGHT)[..., 2:]
    by_direction = np.where(z < 0, 1.0 - z, [0.5, 0.1, 0.0]) * (1 + 0.5 * np.sin(np.arange(WIDTH) / 3))[:, None]
    return LightProfile(by_direction.astype(np.float32), DISTANCES_M**0.7)


def all_lights():
    """One light of every kind and every variant of its formula."""
    color = (3.0, 2.0, 1.0)
    return {
        "point": Light("point", "POINT", color, frame((0.3, 0.5, 0.7))),
        "point soft": Light("point soft", "POINT", color, frame((0.3, 0.45, 0.7)), radius=0.15),
        "point sphere": Light(
            "point sphere", "POINT", color, frame((-0.5, 0.4, 0.66)), radius=0.15, soft_falloff=False
        ),
        "spot": Light("spot", "SPOT", color, frame((0.5, 0.4, 0.8), (-0.3, -0.2, -1)), spot_size=1.2, spot_blend=0.4),
        "spot soft": Light(
            "spot soft",
            "SPOT",
            color,
            frame((0.5, -0.4, 0.8), (-0.3, 0.2, -1)),
            spot_size=1.0,
            spot_blend=0.2,
            radius=0.1,
        ),
        "spot scaled": Light(
            "spot scaled",
            "SPOT",
            color,
            frame((0.5, -0.4, 0.8), (-0.3, 0.2, -1)),
            spot_size=1.0,
            spot_blend=0.2,
            spot_scale=(1.0, 2.0, 1.5),
        ),
        "sun": Light("sun", "SUN", color, frame(towards=(0.3, 0.4, -0.8))),
        "sun wide": Light("sun wide", "SUN", color, frame(towards=(-0.3, 0.4, -0.8)), angle=0.3),
        "rectangle": Light("rectangle", "AREA", color, frame((0.1, 0.2, 0.9), (0.1, 0, -1)), size_x=0.5, size_y=0.3),
        "ellipse": Light(
            "ellipse", "AREA", color, frame((-0.1, -0.3, 0.9), (0, 0.2, -1)), shape="ELLIPSE", size_x=0.4, size_y=0.7
        ),
        "spread": Light(
            "spread", "AREA", color, frame((-0.1, 0.3, 0.9), (0, 0.2, -1)), size_x=0.3, size_y=0.3, spread=1.5
        ),
        "profiled": Light(
            "profiled", "POINT", color, frame((-0.3, -0.5, 0.6), (0.3, 0.4, -0.9)), radius=0.1, profile=some_profile()
        ),
        "shadowless": Light("shadowless", "POINT", color, frame((-0.3, 0.5, -0.6)), casts_shadow=False),
    }


def cluttered_room(lights=None, seed=0, clutter=24):
    """A room with one side open to the sky, pieces of it textured, one wall glowing, and triangles flying about, some
    with holes."""
    generator = np.random.default_rng(seed)
    walls = box((-1.6, -1.3, -1.1), (1.5, 1.4, 1.2))[:, ::-1]
    walls = np.delete(walls, (1, 7), axis=0)  # the ceiling is the sky
    pieces = generator.uniform(-1, 1, (clutter, 1, 3)) + generator.normal(0, 0.3, (clutter, 3, 3))
    corners = np.concatenate([walls, pieces])
    corners += generator.normal(0, 0.01, 3)  # nothing lines up with anything
    material = np.concatenate([[0, 1, 2, 0, 3] * 2, generator.integers(0, 6, clutter)])
    pixels = generator.random((16, 32, 4)).astype(np.float32)
    holes = np.ones((8, 8, 4), np.float32)
    holes[..., 3] = generator.random((8, 8)) < 0.5
    materials = [
        Material("plain", (0.7, 0.6, 0.5)),
        Material("textured", (0.9, 0.9, 0.9), base_image=0),
        Material("glowing", (0.3, 0.3, 0.3), emission=(0.5, 0.8, 1.0)),
        Material("glowing picture", (0.5, 0.5, 0.5), diffuse_share=0.5, emission=(1.0, 0.5, 0.2), emission_image=0),
        Material("leaf", (0.2, 0.8, 0.3), alpha_image=1, alpha_threshold=0.5),
        Material("net", (0.6, 0.1, 0.1), base_image=0, alpha_image=0, alpha_from_color=True, alpha_threshold=DITHERED),
    ]
    images = [Image("noise", pixels, "REPEAT"), Image("holes", holes, "EXTEND")]
    sky = generator.random((16, 32, 3)).astype(np.float32)
    uvs = generator.uniform(-1, 2, (len(corners), 3, 2))
    # What glows belongs to the walls: as a large object it is light that the field carries, not lamps that are sampled.
    objects = np.where(np.isin(material, (2, 3)), 0, np.concatenate([np.zeros(10, int), 1 + np.arange(clutter) % 4]))
    return snapshot_of(
        corners,
        material,
        materials,
        objects,
        uvs,
        images=images,
        world=World(map=sky),
        lights=list((all_lights() if lights is None else lights).values()),
    )


def with_small_emitter(room):
    """``room`` and a small triangle in it that glows, of a material and an object of its own, the last ones."""
    small = np.array([[(0.8, 0.3, 0.2), (0.85, 0.3, 0.2), (0.8, 0.35, 0.22)]])
    return snapshot_of(
        np.concatenate([room.triangle_positions, small]),
        [*room.material_index, len(room.materials)],
        [*room.materials, Material("small", (0.1, 0.1, 0.1), emission=(50.0, 60.0, 40.0))],
        [*room.object_index, room.object_index.max() + 1],
        np.concatenate([room.corner_uvs, np.zeros((1, 3, 2))]),
        images=room.images,
        world=room.world,
        lights=room.lights,
    )


def moved(snapshot, matrix):
    """``snapshot`` under ``matrix`` (4, 4), a rotation, translation and uniform scale; light of lamps is not
    rescaled."""
    scale = np.cbrt(np.linalg.det(matrix[:3, :3]))
    rotation = matrix[:3, :3] / scale
    lights = []
    for light in snapshot.lights:
        placed = np.eye(4)
        placed[:3, :3] = rotation @ light.matrix[:3, :3]
        placed[:3, 3] = matrix[:3, :3] @ light.matrix[:3, 3] + matrix[:3, 3]
        lights.append(replace(light, matrix=placed))
    return replace(
        snapshot,
        vertices=snapshot.vertices @ matrix[:3, :3].T + matrix[:3, 3],
        corner_normals=(snapshot.corner_normals @ rotation.T).astype(np.float32),
        lights=lights,
    )
