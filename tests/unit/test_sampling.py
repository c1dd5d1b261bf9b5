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


def test_keys_of_probes_texels_lights_and_seeds_differ():
    keys = np.concatenate(
        [
            sampling.texel_keys(np.arange(3)[:, None], np.arange(4), sampling.light_stream(light), seed).reshape(-1, 3)
            for light in range(3)
            for seed in range(3)
        ]
    )
    assert len(np.unique(keys, axis=0)) == 108
    assert len(np.unique(sampling.sample_r2(keys, 0), axis=0)) == 108


def test_keys_wrap_like_unsigned_integers():
    assert sampling.texel_keys(np.array(7), np.array(9), sampling.light_stream(3), 2**31 - 1).tolist() == [
        7,
        9,
        (3 * 0x9E3779B9 + 2**31 - 1) % 2**32,
    ]
