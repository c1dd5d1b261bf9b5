# SPDX-License-Identifier: GPL-3.0-or-later
"""Single elements of arrays on the GPU change, all others stay."""

import numpy as np
from gridlight.gpu_shaders.scatter import scatter, scatter_rows
from gridlight.gpu_shaders.textures import read, upload


def test_elements_change_and_others_stay():
    generator = np.random.default_rng(0)
    values = generator.random((20_000, 4)).astype(np.float32)
    texture = upload(values, "numbers")
    index = generator.permutation(20_000)[:3000]
    values[index] = generator.random((3000, 4))
    scatter(texture, index, values[index])
    np.testing.assert_array_equal(read(texture, 20_000), values)


def test_rows_of_several_elements():
    generator = np.random.default_rng(1)
    values = generator.random((3000, 7, 4)).astype(np.float32)
    texture = upload(values, "numbers")
    rows = np.array([0, 17, 1500, 2999])
    values[rows] += 1
    scatter_rows(texture, rows, values[rows])
    np.testing.assert_array_equal(read(texture, 21_000), values.reshape(-1, 4))
