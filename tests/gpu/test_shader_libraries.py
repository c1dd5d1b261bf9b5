# SPDX-License-Identifier: GPL-3.0-or-later
"""Each GLSL library, asked directly, against its twin in core/."""

import numpy as np
import pytest
from gridlight.core import bvh, cubemap, direct_light, images, rays, sampling
from gridlight.core import spherical_harmonics as sh
from gridlight.core.snapshot import Image
from gridlight.gpu_shaders import scene_textures, textures
from gridlight.gpu_shaders.image_textures import kept_or_sent
from shader_runner import run
from small_scenes import all_lights, box

ORIGIN = np.zeros(3)


def halves(values):
    return np.stack([values >> 16, values & 0xFFFF], axis=-1)


def random_directions(count, seed=0):
    directions = np.random.default_rng(seed).normal(size=(count, 3)).astype(np.float32)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_random_numbers_to_the_last_bit():
    generator = np.random.default_rng(0)
    keys = generator.integers(0, 2**32, (5000, 3), dtype=np.uint32)
    index = generator.integers(0, 4096, 5000)
    rest = np.concatenate([halves(keys[:, 2]), index[:, None]], axis=1)
    found = run(
        "random_numbers",
        5000,
        libraries=["data_lib", "random_lib"],
        elements=10_000,
        inputs={"keys": np.concatenate([halves(keys[:, 0]), halves(keys[:, 1])], axis=1), "more_keys": rest},
    ).reshape(5000, 8)
    hashed = sampling.pcg3d(keys)
    np.testing.assert_array_equal(found[:, :4], np.concatenate([halves(hashed[:, 0]), halves(hashed[:, 1])], axis=1))
    np.testing.assert_array_equal(found[:, 6:], halves(hashed[:, 2]))
    expected = np.stack([sampling.sample_r2(keys[i], index[i]) for i in range(5000)])
    np.testing.assert_array_equal(found[:, 4:6], expected)


@pytest.mark.parametrize("face", [4, 16, 31])
def test_directions_texels_and_harmonics(face):
    directions = np.concatenate(
        [random_directions(4000), cubemap.texel_directions(face).reshape(-1, 3), np.eye(3), -np.eye(3)]
    )
    directions = directions.astype(np.float32)
    count = len(directions)
    found = run(
        "directions",
        count,
        libraries=["data_lib", "octahedral_lib", "cubemap_lib", "spherical_harmonics_lib"],
        elements=8 * count,
        inputs={"directions": directions},
        defines={"FACE": face, "BANDS": 4, "COEFFICIENTS": 16},
    ).reshape(count, 8, 4)
    uv = cubemap.octahedral_encode(directions.astype(float))
    on_fold = np.abs(np.abs(directions).min(axis=1)) < 1e-6  # there two coordinates name one direction
    np.testing.assert_allclose(found[~on_fold, 0, :2], uv[~on_fold], atol=1e-6)
    np.testing.assert_allclose(found[:, 1, :3], directions, atol=1e-6)
    index, row, column = cubemap.direction_to_texel(directions.astype(float), face)
    agree = (found[:, 0, 2] == column) & (found[:, 0, 3] == index * face + row)
    assert agree.mean() > 0.999 and agree[4000 : 4000 + 6 * face**2].all()
    np.testing.assert_allclose(
        found[agree, 2, :3], cubemap.texel_directions(face)[index, row, column][agree], atol=3e-7
    )
    np.testing.assert_allclose(found[:, 3:7].reshape(count, 16), sh.basis(directions, 4), atol=3e-6)


class RayScene:
    """Triangles on the GPU without materials."""

    def __init__(self, corners, lean=False):
        self.corners = np.asarray(corners, np.float32)
        self.hierarchy = bvh.build(self.corners)
        rows = np.zeros((len(self.corners), 3, 4), np.float32)
        rows[:, :, :3] = self.corners[self.hierarchy.order]
        rows[:, 0, 3] = self.hierarchy.leaf_end
        self.textures = {
            "bvh_nodes": textures.upload(self.hierarchy.nodes, "nodes"),
            "triangle_corners": textures.upload(rows, "corners"),
        }
        self.defines = {"STACK_SIZE": self.hierarchy.stack_size} | ({"LEAN_STACK": ""} if lean else {})

    def trace(self, origins, directions, limits=1e30):
        """distance, triangle (in the caller's order), barycentric, any hit"""
        count = len(origins)
        limits = np.broadcast_to(limits, count)[:, None]
        found = run(
            "rays",
            count,
            libraries=["data_lib", "offset_lib", "ray_lib"],
            elements=2 * count,
            textures_2d=self.textures,
            defines=self.defines,
            inputs={"origins": origins, "directions": np.concatenate([directions, limits], axis=1)},
        ).reshape(count, 2, 4)
        triangle = found[:, 0, 1].astype(int)
        triangle = np.where(triangle >= 0, self.hierarchy.order[triangle], -1)
        return found[:, 0, 0], triangle, found[:, 0, 2:], found[:, 1, 0] > 0


@pytest.mark.parametrize("lean", [False, True])
def test_rays_find_what_brute_force_finds(lean):
    generator = np.random.default_rng(0)
    corners = (generator.uniform(-1, 1, (400, 1, 3)) + generator.normal(0, 0.15, (400, 3, 3))).astype(np.float32)
    origins = generator.uniform(-1.5, 1.5, (20_000, 3)).astype(np.float32)
    directions = random_directions(20_000)
    limits = generator.uniform(0.1, 2, 20_000).astype(np.float32)
    distance, triangle, barycentric, blocked = RayScene(corners, lean).trace(origins, directions, limits)
    expected = rays.closest_hit(corners.astype(float), origins.astype(float), directions.astype(float))
    agree = triangle == expected.triangle
    assert agree.mean() > 0.9995  # the rest graze an edge, where float32 decides otherwise
    hit = agree & (triangle >= 0)
    # Distances of slanted hits lose what the slant costs; nearly all agree to 1e-5.
    error = np.abs(distance[hit] / expected.distance[hit] - 1)
    assert np.quantile(error, 0.99) < 1e-5 and error.max() < 1e-2
    assert np.quantile(np.abs(barycentric[hit] - expected.barycentric[hit]), 0.99) < 1e-4
    assert (blocked == (expected.distance < limits)).mean() > 0.9995


@pytest.mark.parametrize("count", [100_000, pytest.param(1_000_000, marks=pytest.mark.nightly)])
def test_no_ray_escapes_a_closed_mesh(count):
    """A sphere of 20 000 triangles, half of the rays aimed at its vertices and edges."""
    generator = np.random.default_rng(1)
    rows, columns = 100, 100
    polar = np.linspace(0, np.pi, rows + 1)
    around = np.linspace(0, 2 * np.pi, columns, endpoint=False)
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.outer(np.cos(polar), np.ones(columns)),
        ],
        -1,
    ).astype(np.float32)
    ring[0], ring[-1] = (0, 0, 1), (0, 0, -1)
    i, j = (g.ravel() for g in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    k = (j + 1) % columns
    corners = np.concatenate(
        [
            np.stack([ring[i, j], ring[i + 1, j], ring[i + 1, k]], 1),
            np.stack([ring[i, j], ring[i + 1, k], ring[i, k]], 1),
        ]
    )
    t = generator.random((count, 1))
    which = generator.integers(0, len(corners), count)
    targets = corners[which, 0] * t + corners[which, 1] * (1 - t)
    targets[::4] = corners[which[::4], 0]
    origins = generator.uniform(-0.4, 0.4, (count, 3)).astype(np.float32)
    directions = (targets - origins).astype(np.float32)
    directions[1::2] = random_directions(len(directions[1::2]), 2)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    scene = RayScene(corners)
    escaped = 0
    for start in range(0, count, 100_000):
        part = slice(start, start + 100_000)
        distance, triangle, _barycentric, blocked = scene.trace(origins[part], directions[part])
        escaped += int((triangle < 0).sum() + (~blocked).sum())
    assert escaped == 0


def test_rays_along_axes_and_in_box_planes():
    corners = np.concatenate([box((i, j, 0), (i + 1, j + 1, 1)) for i in range(4) for j in range(4)])
    x, y = (g.ravel() for g in np.meshgrid(np.arange(1, 16) / 4, np.arange(1, 16) / 4))
    origins = np.stack([x, y, 0 * x + 5], axis=1)
    distance, _triangle, _barycentric, blocked = RayScene(corners).trace(origins, np.tile([0, 0, -1.0], (len(x), 1)))
    np.testing.assert_allclose(distance, 4, rtol=1e-6)
    assert blocked.all()


def points_in_the_room(count=4000, seed=5):
    generator = np.random.default_rng(seed)
    return generator.uniform([-1.4, -1.2, -1], [1.4, 1.2, 0.4], (count, 3)).astype(np.float32), random_directions(
        count, seed + 1
    )


@pytest.mark.parametrize("name", all_lights())
def test_direct_light(name):
    """Every kind of light, with and without a triangle in the way, at 4000 points."""
    light = all_lights()[name]
    points, normals = points_in_the_room()
    blocker = np.array([[[-0.5, -0.5, 0.45], [0.6, -0.4, 0.5], [0.0, 0.7, 0.55]]], np.float32)
    scene = RayScene(blocker)
    places = np.random.default_rng(6).random((4000, 2)).astype(np.float32)
    rows = scene_textures.pack_lights([light], ORIGIN)
    lamp = textures.upload(scene_textures.with_profiles(rows, [light.profile]), "lights")
    found = run(
        "lights",
        4000,
        libraries=["data_lib", "random_lib", "offset_lib", "ray_lib", "passage_lib", "direct_light_lib"],
        inputs={"points": points, "normals": normals, "places": places},
        textures_2d={**scene.textures, "lights": lamp},
        defines={**scene.defines, "light_count": 1} | ({"HAS_PROFILES": ""} if light.profile else {}),
    )[:, :3]

    def visible(origins, directions, limits):
        return ~rays.any_hit(blocker.astype(float), origins, directions, limits)

    points, normals = points.astype(float), normals.astype(float)
    expected = direct_light.irradiance(light, points, points, normals, places.astype(float), visible)
    assert (expected.any(axis=1)).mean() > 0.02
    # Beside an edge of a shadow, a cone or the horizon float32 decides otherwise for single samples; elsewhere 1e-5 of
    # the brightest, or of the value where it is larger: soft edges and cosines near zero lose relative precision.
    scale = np.maximum(expected.max(axis=1), 0.05 * np.median(expected[expected > 0]))
    error = np.abs(found - expected).max(axis=1) / scale
    assert (error < 2e-5).mean() > 0.98, np.quantile(error, [0.5, 0.9, 0.98, 0.995])
    assert (error < 1e-3).mean() > 0.995, np.quantile(error, [0.5, 0.9, 0.98, 0.995])
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=1e-3)


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
@pytest.mark.parametrize("size", [(32, 16), (7, 5), (1, 1)])
def test_images(extension, size):
    generator = np.random.default_rng(3)
    picture = Image("noise", generator.random((size[1], size[0], 4)).astype(np.float32), extension)
    sent = kept_or_sent([picture])
    places = np.zeros((4000, 4), np.float32)
    places[:, :2] = generator.uniform(-2.5, 2.5, (4000, 2))
    places[:, 2] = generator.choice([0, 0.04, 0.11, 0.23, 0.6, 3.0], 4000)
    found = run(
        "images",
        4000,
        libraries=["data_lib", "surface_lib"],
        inputs={"places": places},
        defines={"HAS_IMAGES": ""},
        textures_2d={
            "image_table": sent.table,
            "image_texels": sent.texels,
            "triangle_corners": textures.upload(np.zeros((1, 4)), "none"),
            "materials": textures.upload(np.zeros((1, 4)), "none"),
            "triangle_attributes": textures.upload(np.zeros((1, 4)), "none"),
        },
    )
    expected = images.sample_image(picture, places[:, :2].astype(float), places[:, 2].astype(float))
    # mips are averaged in float32 before they are rounded to half floats: now and then one unit of 2⁻¹¹ apart
    np.testing.assert_allclose(found, expected, atol=6e-4)
    assert (np.abs(found - expected) < 1e-5).mean() > 0.95
