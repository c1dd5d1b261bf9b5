# SPDX-License-Identifier: GPL-3.0-or-later
"""Looking up images: the readable twin of ``sample_image`` in gpu_shaders/glsl/surface_lib.glsl.

Bilinear in one mip level, the one whose texel comes nearest to the sampled area. Texels are half floats, as the GPU
stores them.
"""

from __future__ import annotations

import numpy as np

from .snapshot import Image

HALF_MAX = 65504.0


def mip_level(image: Image, footprint: np.ndarray) -> np.ndarray:
    """(N,) level for sampled areas ``footprint`` (N,) uv units wide: texels per footprint, log2, rounded."""
    longest = max(image.pixels.shape[:2])
    level = np.floor(np.log2(np.maximum(footprint * longest, 1.0)) + 0.5).astype(int)
    return np.minimum(level, 0 if image.extension == "ATLAS" else int(np.log2(longest)))


def smaller(pixels: np.ndarray) -> np.ndarray:
    """The next mip level of ``pixels`` (H, W, 4): an even share of rows and columns averaged into each texel, sizes
    halved and rounded down."""
    height, width = (max(size // 2, 1) for size in pixels.shape[:2])
    result = np.empty((height, width, 4))
    for row in range(height):
        for column in range(width):
            rows = slice(row * pixels.shape[0] // height, (row + 1) * pixels.shape[0] // height)
            columns = slice(column * pixels.shape[1] // width, (column + 1) * pixels.shape[1] // width)
            result[row, column] = pixels[rows, columns].mean(axis=(0, 1))
    return result


def sample_image(image: Image, uv: np.ndarray, footprint: np.ndarray) -> np.ndarray:
    """(N, 4) linear RGBA at ``uv`` (N, 2), averaged over areas ``footprint`` (N,) uv units wide."""
    levels = mip_level(image, footprint)
    result = np.zeros((len(uv), 4))
    pixels = np.asarray(image.pixels, float)
    for level in range(levels.max(initial=0) + 1):
        here = levels == level
        result[here] = _bilinear(
            np.minimum(pixels, HALF_MAX).astype(np.float16).astype(float), uv[here], image.extension
        )
        pixels = smaller(pixels)
    if image.extension == "CLIP":
        result[(uv.min(axis=1) < 0) | (uv.max(axis=1) > 1)] = 0
    return result


def _bilinear(pixels: np.ndarray, uv: np.ndarray, extension: str) -> np.ndarray:
    size = np.array(pixels.shape[1::-1])
    position = uv * size - 0.5
    corner = np.floor(position).astype(int)
    blend = position - corner
    result = np.zeros((len(uv), 4))
    for step in np.ndindex(2, 2):
        texel = wrapped(corner + step, size, extension)
        weight = np.where(step, blend, 1 - blend).prod(axis=1)
        result += weight[:, None] * pixels[texel[:, 1], texel[:, 0]]
    return result


def wrapped(texel: np.ndarray, size: np.ndarray | int, extension: str) -> np.ndarray:
    """Indices ``texel`` of any size, brought into 0 … ``size`` − 1 as ``extension`` of an image texture node says."""
    if extension == "REPEAT":
        return texel % size
    if extension == "MIRROR":
        folded = texel % (2 * size)
        return np.where(folded < size, folded, 2 * size - 1 - folded)
    return np.clip(texel, 0, size - 1)
