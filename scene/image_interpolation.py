# SPDX-License-Identifier: GPL-3.0-or-later
"""Between pixels of an sRGB image: Cycles interpolates what is stored and decodes what comes out.

Lookups here interpolate linear values, which is brighter where neighbours differ: by a fifth in an image of noise. So
such images are interpolated once, on a finer grid, before they are decoded.
"""

from __future__ import annotations

import numpy as np

from ..core.images import wrapped

_EDGE = 512  # of the finer grid, about
_LEAST_GAIN, _MOST_GAIN = 2, 8
MOST_EDGE = 2048  # of images that are worth the memory
_ALIKE = 0.015  # relative difference of means that nobody sees
_SAMPLES, _SAMPLE_EDGE = 8, 16  # pieces along each edge of a large image, of so many pixels, that tell whether to


def finer_grid(encoded: np.ndarray, decode, interpolation: str, extension: str) -> np.ndarray | None:
    """``encoded`` (H, W, C), stored values 0..1, interpolated as Blender's image texture node does at several points a
    pixel, of the same layout; None where that makes no difference to what ``decode`` yields.

    ``interpolation`` and ``extension`` are the node's."""
    edge = max(encoded.shape[:2])
    if interpolation == "Closest" or edge > MOST_EDGE or edge < 2:
        return None
    parts = _parts(encoded)
    mean = decode(parts).mean(axis=(0, 1, 2))
    beyond = extension if len(parts) == 1 else "EXTEND"  # what lies beyond a piece is not what lies beyond the image
    between = decode(_resampled(parts, _LEAST_GAIN, interpolation, beyond)).mean(axis=(0, 1, 2))
    if (np.abs(between - mean) <= _ALIKE * mean).all():
        return None
    return _resampled(encoded, int(np.clip(_EDGE // edge, _LEAST_GAIN, _MOST_GAIN)), interpolation, extension)


def _parts(encoded: np.ndarray) -> np.ndarray:
    """(N, h, w, C): pieces of ``encoded`` (H, W, C) all over it, or the whole of a small image."""
    if max(encoded.shape[:2]) <= _SAMPLES * _SAMPLE_EDGE:
        return encoded[None]
    height, width = (min(size, _SAMPLE_EDGE) for size in encoded.shape[:2])
    rows, columns = (
        np.unique(np.linspace(0, size - part, _SAMPLES).astype(int))
        for size, part in zip(encoded.shape, (height, width))
    )
    return np.stack([encoded[row : row + height, column : column + width] for row in rows for column in columns])


def _resampled(pixels: np.ndarray, gain: int, interpolation: str, extension: str) -> np.ndarray:
    """``pixels`` (…, H, W, C) at the middles of ``gain`` × ``gain`` parts of every pixel."""
    for axis in (-3, -2):
        count = pixels.shape[axis]
        position = (np.arange(gain * count) + 0.5) / gain - 0.5
        first = np.floor(position).astype(int)
        taps = _taps(position - first, interpolation == "Cubic")
        shape = [1] * pixels.ndim
        shape[axis] = -1
        total = 0.0
        for step, weight in taps.items():
            source = np.take(pixels, wrapped(first + step, count, extension), axis)
            total = total + source * weight.astype(np.float32).reshape(shape)
        pixels = total
    return pixels


def _taps(t: np.ndarray, cubic: bool) -> dict[int, np.ndarray]:
    """Weight of the pixels around by their step from the first, for places ``t`` 0..1 after it."""
    if not cubic:
        return {0: 1 - t, 1: t}
    return {  # a cubic B-spline, which is what Cycles calls cubic
        -1: (1 - t) ** 3 / 6,
        0: (3 * t**3 - 6 * t**2 + 4) / 6,
        1: (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6,
        2: t**3 / 6,
    }
