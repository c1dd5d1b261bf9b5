# SPDX-License-Identifier: GPL-3.0-or-later
"""Equirectangular radiance panoramas: directions, solid angles, and their integrals over the sphere.

Layout, the same as Cycles' environment texture and panoramic camera and as ``core.snapshot.World``::

    row H−1, v = 1   straight up (+Z)          u = ½ − atan2(y, x) / 2π     column = u · W − ½
    row 0,   v = 0   straight down (−Z)        v = asin(z) / π + ½          row    = v · H − ½

    u:   0     ¼     ½     ¾     1             seen from inside with +Z up, so u grows to the right
        −X    +Y    +X    −Y    −X

A pixel is a constant over its rectangle in (u, v). All integrals take that literally: a pixel's share of a basis
function is integrated over the rectangle by sub-samples with exact solid angles, not taken at its centre.
"""

from functools import lru_cache

import numpy as np

from .spherical_harmonics import basis

# Rows of the grid on which pixels are integrated: an image with fewer rows is sub-sampled up to it. At 256 rows the
# cosine integral of a uniform sphere is within 2e-5 of π.
_INTEGRATION_ROWS = 256


ALL = slice(None)


def panorama_directions(width: int, height: int, rows=ALL, columns=ALL) -> np.ndarray:
    """(height, width, 3) float64 unit directions of the pixel centres, world space; of ``rows`` and ``columns`` only
    where those are given."""
    longitude = np.pi - 2 * np.pi * (np.arange(width)[columns] + 0.5) / width
    latitude = np.pi * ((np.arange(height)[rows] + 0.5) / height - 0.5)
    directions = np.empty((len(latitude), len(longitude), 3))
    directions[..., 0] = np.cos(latitude)[:, None] * np.cos(longitude)
    directions[..., 1] = np.cos(latitude)[:, None] * np.sin(longitude)
    directions[..., 2] = np.sin(latitude)[:, None]
    return directions


def panorama_solid_angles(width: int, height: int, rows=ALL, columns=ALL) -> np.ndarray:
    """(height, width) float64 exact solid angles of the pixels in steradians; they sum to 4π. Of ``rows`` and
    ``columns`` only where those are given."""
    edges = np.sin(np.pi * (np.arange(height + 1) / height - 0.5))
    in_row = np.diff(edges)[rows] * (2 * np.pi / width)
    return np.repeat(in_row[:, None], len(np.arange(width)[columns]), axis=1)


def panorama_coordinates(directions: np.ndarray) -> np.ndarray:
    """(…, 2) float64 (u, v) in 0..1 of ``directions`` (…, 3), which need not have unit length."""
    x, y, z = np.moveaxis(np.asarray(directions, float), -1, 0)
    u = 0.5 - np.arctan2(y, x) / (2 * np.pi)
    v = np.arctan2(z, np.hypot(x, y)) / np.pi + 0.5
    return np.stack([u, v], axis=-1)


def project_panorama(image: np.ndarray, bands: int) -> np.ndarray:
    """(bands², 3) float64 SH coefficients of a radiance panorama ``image`` (height, width, 3)."""
    height, width = image.shape[:2]
    return np.tensordot(_basis_weights(width, height, bands), image.astype(float), axes=([0, 1], [0, 1]))


def panorama_irradiance(image: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N, 3) float64 irradiance of surfaces facing ``normals`` (N, 3, unit) under the panorama ``image`` (height,
    width, 3).

    Integrates max(0, n·d) over every pixel directly, so nothing is lost to a truncated SH series.
    """
    height, width = image.shape[:2]
    factor = _sub_samples(height)
    directions = panorama_directions(width * factor, height * factor).reshape(-1, 3)
    weights = panorama_solid_angles(width * factor, height * factor).reshape(-1, 1)
    weighted = directions * weights
    pixels = image.astype(float).reshape(-1, 3)
    irradiance = np.empty((len(normals), 3))
    for row, normal in enumerate(np.asarray(normals, float)):  # one at a time: the fine grid is the large dimension
        cosine = np.maximum(weighted @ normal, 0.0)
        shares = cosine.reshape(height, factor, width, factor).sum(axis=(1, 3))
        irradiance[row] = shares.reshape(-1) @ pixels
    return irradiance


def _sub_samples(height: int) -> int:
    return max(1, -(-_INTEGRATION_ROWS // height))


@lru_cache(maxsize=4)
def _basis_weights(width: int, height: int, bands: int) -> np.ndarray:
    """(height, width, bands²) float64: every basis function integrated over every pixel."""
    factor = _sub_samples(height)
    directions = panorama_directions(width * factor, height * factor)
    solid_angles = panorama_solid_angles(width * factor, height * factor)
    weights = np.empty((height, width, bands * bands))
    for row in range(height):  # one row of pixels at a time bounds the memory of large panoramas
        rows = slice(row * factor, (row + 1) * factor)
        integrand = basis(directions[rows], bands) * solid_angles[rows, :, None]
        weights[row] = integrand.reshape(factor, width, factor, -1).sum(axis=(0, 2))
    weights.flags.writeable = False
    return weights
