# SPDX-License-Identifier: GPL-3.0-or-later
"""Changes single elements of a linear array on the GPU, so that what stayed need not be sent again."""

from __future__ import annotations

import gpu
import numpy as np

from .programs import program
from .textures import ROW, upload


def scatter(texture: gpu.types.GPUTexture, index: np.ndarray, values: np.ndarray) -> None:
    """Puts ``values`` (K, 4) into elements ``index`` (K,) of an RGBA32F array made by textures.upload; no element
    twice."""
    places = np.zeros((len(index), 4), np.float32)
    places[:, 0], places[:, 1] = index % ROW, index // ROW
    shader = program("scatter_comp")
    place_texture, value_texture = upload(places, "changes"), upload(values, "changes")
    shader.uniform_sampler("places", place_texture)
    shader.uniform_sampler("values", value_texture)
    shader.image("target", texture)
    shader.uniform_int("value_count", (len(index),))
    gpu.compute.dispatch(shader, -(-len(index) // 64), 1, 1)


def scatter_rows(texture: gpu.types.GPUTexture, rows: np.ndarray, values: np.ndarray) -> None:
    """The same for rows of several elements: ``values`` (K, W, 4) go to row ``rows`` (K,) of an array (…, W, 4)."""
    width = values.shape[1]
    scatter(texture, (rows[:, None] * width + np.arange(width)).ravel(), values.reshape(-1, 4))
