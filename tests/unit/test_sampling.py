# SPDX-License-Identifier: GPL-3.0-or-later
"""Sample numbers: the hash in plain integers, the spread of the sequence, and independence of keys."""

import numpy as np
from gridlight.core import sampling


def pcg3d_in_integers(x, y, z):
    """The published listing with Python's integers, modulo 2³²."""
    mask = 0xFFFFFFFF
    x, y, z = ((v * 1664525 + 1013904223) & mask for v in (x, y, z))
    for _ in range(2):
        x = (x + y * z) & mask
        y = (y + z * x) & mask
        z = (z + x * y) & mask
        if not _:
            x, y, z = (v ^ (v >> 16) for v in (x, y, z))
    return x, y, z


def test_hash_is_the_published_one():
    keys = np.random.default_rng(0).integers(0, 2**32, (200, 3), dtype=np.uint32)
    keys[:3] = [[0, 0, 0], [1, 2, 3], [0xFFFFFFFF] * 3]
    expected = [pcg3d_in_integers(*map(int, key)) for key in keys]
    np.testing.assert_array_equal(sampling.pcg3d(keys), np.array(expected, np.uint32))


def test_numbers_are_in_the_unit_square_and_even():
    keys = np.stack([np.arange(2000), np.zeros(2000, int), np.zeros(2000, int)], 1).astype(np.uint32)
    numbers = sampling.sample_r2(keys, 3)
    assert numbers.min() >= 0 and numbers.max() < 1
    assert np.abs(numbers.mean(axis=0) - 0.5).max() < 0.03
    counts = np.histogram2d(*numbers.T, bins=4, range=[[0, 1], [0, 1]])[0]
    assert counts.min() > 80


def test_samples_of_one_key_are_stratified():
    """R2 integrates a smooth function far better than random numbers would (1/√1024 · σ ≈ 0.01)."""
    key = np.array([[5, 6, 7]], np.uint32)
    numbers = np.concatenate([sampling.sample_r2(key, i) for i in range(1024)]).astype(float)
    assert abs((numbers[:, 0] * numbers[:, 1] ** 2).mean() - 1 / 6) < 3e-3


def test_steps_are_powers_of_the_roots():
    """1/ρ, 1/ρ² of ρ³ = ρ + 1 and 1/ρ … 1/ρ³ of ρ⁴ = ρ + 1, times 2³², rounded."""
    for step, degree in ((sampling.R2_STEP, 3), (sampling.R3_STEP, 4)):
        roots = np.roots([1, *[0] * (degree - 2), -1, -1])
        root = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 1)][0].real
        expected = [2.0**32 / root**power for power in range(1, degree)]
        assert np.abs(step.astype(float) - expected).max() < 2


def test_three_numbers():
    """The mean of a smooth function over the cube, by 4096 numbers of one key; any index has its own numbers."""
    key = np.array([[5, 6, 7]], np.uint32)
    numbers = sampling.sample_r3(np.broadcast_to(key, (4096, 3)), np.arange(4096)).astype(float)
    assert numbers.min() >= 0 and numbers.max() < 1
    assert abs((numbers[:, 0] * numbers[:, 1] ** 2 * numbers[:, 2] ** 3).mean() - 1 / 24) < 5e-4
    np.testing.assert_array_equal(sampling.sample_r3(key, 1000)[0], numbers[1000].astype(np.float32))
    far = sampling.sample_r3(np.broadcast_to(key, (4096, 3)), 10**6 + np.arange(4096))
    assert len(np.unique(far, axis=0)) == 4096, "no precision is lost at large indices"


def test_an_index_for_each_key():
    keys = np.random.default_rng(1).integers(0, 2**32, (50, 3), dtype=np.uint32)
    found = sampling.sample_r2(keys, np.arange(50))
    np.testing.assert_array_equal(found, np.concatenate([sampling.sample_r2(keys[i : i + 1], i) for i in range(50)]))


def test_keys_of_patches_lights_and_seeds_differ():
    keys = np.concatenate(
        [
            sampling.light_keys(sampling.keys_of(np.arange(12), stream, seed), light)
            for stream in (0, 0x85EBCA6B)
            for light in range(3)
            for seed in range(3)
        ]
    )
    assert len(np.unique(keys, axis=0)) == 216
    assert len(np.unique(sampling.sample_r2(keys, 0), axis=0)) == 216


def test_keys_wrap_like_unsigned_integers():
    keys = sampling.light_keys(sampling.keys_of(np.array(7), 9, 2**31 - 1), 3)
    assert keys.tolist() == [7, 9, (3 * 0x9E3779B9 + 2**31 - 1) % 2**32]
    assert sampling.shifted(np.array([2**32 - 1, 0, 5], np.uint32), 2, -1, 2**32).tolist() == [1, 2**32 - 1, 5]


def test_directions_about_a_normal_have_the_density_of_the_cosine():
    """Means over density cos θ/π: cos θ is 2/3, cos² θ is 1/2, and nothing leads sideways."""
    generator = np.random.default_rng(0)
    normals = generator.normal(size=(6, 3))
    normals[0] = (0, 0, -1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    u = sampling.sample_r2(np.broadcast_to(np.array([1, 2, 3], np.uint32), (4096, 3)), np.arange(4096)).astype(float)
    for normal in normals:
        directions = sampling.sample_cosine(np.tile(normal, (4096, 1)), u)
        np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-12)
        cosine = directions @ normal
        assert cosine.min() >= 0
        assert abs(cosine.mean() - 2 / 3) < 2e-3 and abs((cosine**2).mean() - 1 / 2) < 2e-3
        np.testing.assert_allclose(directions.mean(axis=0), normal * 2 / 3, atol=3e-3)


def test_tangent_frames_are_right_angled():
    generator = np.random.default_rng(2)
    normals = np.concatenate([generator.normal(size=(200, 3)), np.eye(3), -np.eye(3)])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    tangent, bitangent = sampling.tangent_frame(normals)
    np.testing.assert_allclose(np.cross(tangent, bitangent), normals, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(tangent, axis=1), 1, rtol=1e-12)
