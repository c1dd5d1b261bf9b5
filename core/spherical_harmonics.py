# SPDX-License-Identifier: GPL-3.0-or-later
"""Real orthonormal spherical harmonics, bands 0 to 3, in the project's convention (core/conventions.py).

Sources: the basis as in Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC 2008, appendix A2, with the
Condon-Shortley signs removed; the cosine lobe as in Ramamoorthi and Hanrahan, SIGGRAPH 2001, eq. 8.
GLSL twin: gpu_shaders/glsl/spherical_harmonics_lib.glsl.
"""

from __future__ import annotations

import numpy as np

from .conventions import COSINE_LOBE, band_of, bands_of

# Factors of the first nine functions, as polynomials: 1; y, z, x; xy, yz, 3z² − 1, xz, x² − y².
Y0 = 0.28209479177387814  # √(1/4π): L00 · Y0 is the mean radiance
Y1 = 0.4886025119029199  # √(3/4π)
Y2_MIXED = 1.0925484305920792  # √(15/4π)
Y2_ZZ = 0.31539156525252005  # √(5/16π)
Y2_XX = 0.5462742152960396  # √(15/16π)
POLYNOMIAL_FACTORS = np.array([Y0, Y1, Y1, Y1, Y2_MIXED, Y2_MIXED, Y2_ZZ, Y2_MIXED, Y2_XX])


def basis(directions: np.ndarray, bands: int) -> np.ndarray:
    """Values of the first ``bands``² basis functions at unit ``directions`` (…, 3); returns (…, bands²)."""
    x, y, z = np.moveaxis(np.asarray(directions, float), -1, 0)
    values = [np.full_like(x, Y0)]
    if bands > 1:
        values += [Y1 * y, Y1 * z, Y1 * x]
    if bands > 2:
        values += [
            Y2_MIXED * x * y,
            Y2_MIXED * y * z,
            Y2_ZZ * (3 * z * z - 1),
            Y2_MIXED * x * z,
            Y2_XX * (x * x - y * y),
        ]
    if bands > 3:
        c33, c31 = 0.5900435899266435, 0.4570457994644658
        values += [
            c33 * y * (3 * x * x - y * y),
            2.890611442640554 * x * y * z,
            c31 * y * (5 * z * z - 1),
            0.3731763325901154 * z * (5 * z * z - 3),
            c31 * x * (5 * z * z - 1),
            1.445305721320277 * z * (x * x - y * y),
            c33 * x * (x * x - 3 * y * y),
        ]
    return np.stack(values, axis=-1)


def basis_gradient(directions: np.ndarray, bands: int) -> np.ndarray:
    """Gradients on the sphere of the first ``bands``² basis functions, up to three bands, at unit ``directions``
    (…, 3); returns (…, bands², 3), vectors perpendicular to the direction.

    Those of the polynomials less their part along the direction, which is l·Y for a homogeneous one (Euler).
    """
    directions = np.asarray(directions, float)
    x, y, z = np.moveaxis(directions, -1, 0)
    zero, one = np.zeros_like(x), np.ones_like(x)
    values = [(zero, zero, zero)]
    if bands > 1:
        values += [(zero, Y1 * one, zero), (zero, zero, Y1 * one), (Y1 * one, zero, zero)]
    if bands > 2:
        values += [
            (Y2_MIXED * y, Y2_MIXED * x, zero),
            (zero, Y2_MIXED * z, Y2_MIXED * y),
            (-2 * Y2_ZZ * x, -2 * Y2_ZZ * y, 4 * Y2_ZZ * z),
            (Y2_MIXED * z, zero, Y2_MIXED * x),
            (2 * Y2_XX * x, -2 * Y2_XX * y, zero),
        ]
    polynomial = np.stack([np.stack(value, axis=-1) for value in values], axis=-2)
    degree = np.array([band_of(index) for index in range(bands * bands)])
    return polynomial - (degree * basis(directions, bands))[..., None] * directions[..., None, :]


def cosine_lobe(bands: int) -> np.ndarray:
    """(bands²,) factor A_l of every coefficient: radiance SH to irradiance SH."""
    return np.array([COSINE_LOBE[band_of(index)] for index in range(bands * bands)])


def project(radiance: np.ndarray, directions: np.ndarray, solid_angles: np.ndarray, bands: int) -> np.ndarray:
    """Coefficients ∫ L Y dω of samples.

    ``radiance`` (…, S, C), ``directions`` (S, 3) unit, ``solid_angles`` (S,) steradian; returns (…, bands², C).
    """
    weighted = basis(directions, bands) * np.asarray(solid_angles, float)[:, None]
    return np.einsum("sk,...sc->...kc", weighted, radiance)


def irradiance(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance at unit ``normals`` (…, 3) of radiance ``coefficients`` (…, bands², C); returns (…, C).

    Leading shapes broadcast. The result may be negative where the series rings: callers decide whether to clamp.
    """
    coefficients = np.asarray(coefficients, float)
    bands = bands_of(coefficients.shape[-2])
    transfer = basis(normals, bands) * cosine_lobe(bands)
    return np.einsum("...k,...kc->...c", transfer, coefficients)


def radiance(coefficients: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Band-limited radiance seen along unit ``directions`` (…, 3); shapes as in ``irradiance``."""
    coefficients = np.asarray(coefficients, float)
    bands = bands_of(coefficients.shape[-2])
    return np.einsum("...k,...kc->...c", basis(directions, bands), coefficients)
