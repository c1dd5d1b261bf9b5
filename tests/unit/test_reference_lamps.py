# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps that share shadow rays send on average what each would by its own."""

import numpy as np
import pytest
from gridlight.core import direct_light
from gridlight.core.patches import MOST_PARTS, lamps_a_ray, light_parts, spread_points
from gridlight.core.reference_lamps import ReferenceLamps
from gridlight.core.reference_scene import ReferenceScene
from gridlight.core.sampling import WeightedChoice, keys_of, sample_r2, shifted
from gridlight.core.snapshot import Light, Material, SceneSnapshot, World

LAMPS, PLACES, KEYS, SAMPLES = 70, 6, 500, 4
pytestmark = pytest.mark.any_version


def matrix_at(position):
    matrix = np.eye(4)
    matrix[:3, 3] = position
    return matrix


@pytest.fixture
def lamps():
    """Above a floor, half of them behind a wall; one takes light away, another casts no shadow."""
    generator = np.random.default_rng(3)
    wall = [[[0.2, -9, -1], [0.2, 9, -1], [0.2, 9, 9]], [[0.2, -9, -1], [0.2, 9, 9], [0.2, -9, 9]]]
    positions = generator.uniform([-2, -2, 0.5], [2, 2, 2], (LAMPS, 3))
    lights = [
        Light(f"lamp {i}", "POINT", generator.uniform(0, 9, 3), matrix_at(position), radius=0.1 * (i % 2))
        for i, position in enumerate(positions)
    ]
    lights[7] = Light("dark", "POINT", (-20.0, -5.0, -9.0), matrix_at((-0.5, 0.5, 1.0)))
    lights[9] = Light("everywhere", "POINT", (4.0, 9.0, 9.0), matrix_at((1.0, 0.2, 1.0)), casts_shadow=False)
    snapshot = SceneSnapshot(
        vertices=np.array(wall, float).reshape(-1, 3),
        triangles=np.arange(6, dtype=np.int32).reshape(-1, 3),
        corner_normals=np.zeros((2, 3, 3), np.float32),
        corner_uvs=np.zeros((2, 3, 2), np.float32),
        material_index=np.zeros(2, np.int32),
        object_index=np.zeros(2, np.int32),
        object_names=["wall"],
        materials=[Material("wall")],
        images=[],
        lights=lights,
        world=World(),
    )
    return ReferenceLamps(ReferenceScene(snapshot, np.zeros(3)), [])


def test_one_ray_for_many(lamps):
    places = np.random.default_rng(4).uniform([-2, -2, 0], [0, 2, 0], (PLACES, 3))
    points = np.repeat(places, KEYS, axis=0)
    normals, role = np.tile([0.0, 0.0, 1.0], (len(points), 1)), np.zeros(len(points), int)
    keys, visible = keys_of(np.arange(len(points)), 0, 0), lamps.scene.visible
    plain = np.tile([0.0, 0.0, 0.0, 1.0], (len(points), 1))  # light counts alike from everywhere

    def mean(values):
        return values.reshape(PLACES, KEYS, 3).mean(axis=1)

    expected = np.zeros((PLACES, 3))
    for number, lamp in enumerate(lamps.all()):
        u = sample_r2(shifted(keys, 1, number, 1), 0).astype(float)
        expected += mean(direct_light.irradiance(lamp, points, points, normals, u, visible))
    rays = []
    lamps.scene.visible = lambda origins, *way, **group: rays.append(len(origins)) or visible(origins, *way, **group)
    each = np.array([lamps.irradiance(points, points, normals, keys, index, role, plain) for index in range(SAMPLES)])
    assert sum(rays) <= MOST_PARTS * len(points) * SAMPLES
    deviation = np.std(each.reshape(SAMPLES, PLACES, KEYS, 3), axis=(0, 2))
    noise = deviation / np.sqrt(SAMPLES * KEYS)
    assert (np.abs(mean(each.mean(axis=0)) - expected) < 4 * noise + 2e-3 * expected.max()).all()
    assert deviation.max() < 0.5 * expected.max()
    apart = sum(
        lamps.irradiance(points, points, normals, keys, 3, role, plain, part) for part in light_parts(LAMPS, False)
    )
    np.testing.assert_allclose(apart, each[3])


def test_choice_in_proportion():
    weights = np.array([0.0, 1.0, 5.0, 0.0, 2.0])
    count = 8000
    choice, chosen = WeightedChoice((np.arange(count) + 0.5) / count), np.full(count, -1)
    for number, weight in enumerate(weights):
        chosen[choice.takes(np.full(count, weight))] = number
    np.testing.assert_allclose(np.bincount(chosen, minlength=5) / count, weights / 8, atol=2 / count)
    np.testing.assert_array_equal(choice.weight, weights[chosen])
    assert (choice.total == 8).all()


def test_few_lamps_do_not_share():
    assert lamps_a_ray(0) == lamps_a_ray(MOST_PARTS) == 1 and lamps_a_ray(MOST_PARTS + 1) == 2
    assert spread_points((0, 1), 3) == 8 and spread_points((0, 50), 800) == 2
