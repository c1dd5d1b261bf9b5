# SPDX-License-Identifier: GPL-3.0-or-later
"""Spherical harmonics against their definition: order, sign, orthonormality, rotation, and the cosine lobe."""

from math import factorial

import numpy as np
import pytest
from gridlight.core import spherical_harmonics as sh
from gridlight.core.conventions import COSINE_LOBE, band_of, coefficient_names
from gridlight.core.cubemap import texel_directions, texel_solid_angles
from numpy.polynomial import Legendre, Polynomial

BANDS = 4


def quadrature():
    """Directions (N, 3) and weights (N,) that integrate polynomials on the sphere up to degree 15 exactly."""
    z, weight = np.polynomial.legendre.leggauss(8)
    angle = 2 * np.pi * np.arange(16) / 16
    sine = np.sqrt(1 - z * z)
    directions = np.stack([np.outer(sine, np.cos(angle)), np.outer(sine, np.sin(angle)), np.outer(z, np.ones(16))], -1)
    return directions.reshape(-1, 3), np.repeat(weight, 16) * 2 * np.pi / 16


def random_directions(count, seed=0):
    directions = np.random.default_rng(seed).normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def definition(l, m, directions):
    """Y_lm = √2 K cos(mφ) P_lm(z), sin(|m|φ) for m < 0, without the Condon-Shortley phase (−1)^m."""
    x, y, z = directions.T
    order = abs(m)
    legendre = (
        Legendre.basis(l).convert(kind=Polynomial).deriv(order) if order else Legendre.basis(l).convert(kind=Polynomial)
    )
    associated = (1 - z * z) ** (order / 2) * legendre(z)
    norm = np.sqrt((2 * l + 1) / (4 * np.pi) * factorial(l - order) / factorial(l + order))
    angle = np.arctan2(y, x)
    turn = 1.0 if m == 0 else np.sqrt(2) * (np.cos(m * angle) if m > 0 else np.sin(order * angle))
    return norm * turn * associated


@pytest.mark.parametrize("l,m", [(l, m) for l in range(BANDS) for m in range(-l, l + 1)])
def test_every_function_is_its_definition(l, m):
    directions = random_directions(200)
    np.testing.assert_allclose(
        sh.basis(directions, BANDS)[:, l * (l + 1) + m], definition(l, m, directions), atol=1e-13
    )


# A direction for every coefficient where it must be positive: written down by hand from the table in
# docs/conventions.md.
POSITIVE = {
    "L00": (0, 0, 1),
    "L1m1": (0, 1, 0),
    "L10": (0, 0, 1),
    "L11": (1, 0, 0),
    "L2m2": (1, 1, 0),
    "L2m1": (0, 1, 1),
    "L20": (0, 0, 1),
    "L21": (1, 0, 1),
    "L22": (1, 0, 0),
    "L3m3": (1.732, 1, 0),
    "L3m2": (1, 1, 1),
    "L3m1": (0, 1, 2),
    "L30": (0, 0, 1),
    "L31": (1, 0, 2),
    "L32": (1, 0, 1),
    "L33": (1, 0, 0),
}


def test_order_and_sign_of_every_coefficient():
    assert coefficient_names(BANDS) == list(POSITIVE)
    directions = np.array(list(POSITIVE.values()), float)
    values = sh.basis(directions / np.linalg.norm(directions, axis=1, keepdims=True), BANDS)
    assert (np.diag(values) > 0.1).all()
    # Turning x and y round changes the sign of exactly those functions that are odd under it.
    turned = sh.basis(directions * [-1, -1, 1] / np.linalg.norm(directions, axis=1, keepdims=True), BANDS)
    odd = np.array([m % 2 == 1 for l in range(BANDS) for m in range(-l, l + 1)])
    np.testing.assert_allclose(np.diag(turned), np.where(odd, -1, 1) * np.diag(values), atol=1e-13)


@pytest.mark.parametrize("bands", range(1, BANDS + 1))
def test_orthonormal(bands):
    directions, weights = quadrature()
    values = sh.basis(directions, bands)
    np.testing.assert_allclose(values.T @ (values * weights[:, None]), np.eye(bands**2), atol=1e-13)


def test_bands_are_prefixes():
    directions = random_directions(20)
    for bands in range(1, BANDS):
        assert (sh.basis(directions, bands) == sh.basis(directions, BANDS)[:, : bands**2]).all()


def test_rotating_the_light_rotates_irradiance():
    """The bands are closed under rotation: light turned by R, read at R·n, is the light at n."""
    rotation, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    rotation *= np.linalg.det(rotation)
    directions, weights = quadrature()
    coefficients = np.random.default_rng(4).normal(size=(BANDS**2, 3))
    turned = sh.project(sh.radiance(coefficients, directions @ rotation), directions, weights, BANDS)
    normals = random_directions(50)
    np.testing.assert_allclose(
        sh.irradiance(turned, normals @ rotation.T), sh.irradiance(coefficients, normals), atol=1e-12
    )


@pytest.mark.parametrize("face", (4, 16, 64))
@pytest.mark.parametrize("bands", range(1, BANDS + 1))
def test_uniform_radiance_gives_pi_times_it(face, bands):
    directions = texel_directions(face).reshape(-1, 3)
    weights = np.tile(texel_solid_angles(face).ravel(), 6)
    radiance = np.tile([0.5, 1.0, 7.0], (len(directions), 1))
    coefficients = sh.project(radiance, directions, weights, bands)
    expected = np.tile(np.pi * radiance[0], (20, 1))
    # texels are points for the basis: band 2 does not integrate to zero exactly, the error falls with the square of
    # the face
    np.testing.assert_allclose(sh.irradiance(coefficients, random_directions(20)), expected, rtol=1e-12 + 0.5 / face**2)
    np.testing.assert_allclose(coefficients[0], radiance[0] * np.sqrt(4 * np.pi), rtol=1e-13)


def test_one_bright_direction():
    """Radiance ω·δ(d) has coefficients ω·Y(d), and irradiance Σ A_l (2l+1)/4π P_l(n·d) by the addition theorem."""
    towards = random_directions(1, 5)
    coefficients = sh.project(np.array([[3.0, 0, 1]]), towards, np.array([0.01]), BANDS)
    np.testing.assert_allclose(coefficients[:, 0], 0.03 * sh.basis(towards[0], BANDS), rtol=1e-14)
    normals = random_directions(50, 6)
    cosine = normals @ towards[0]
    expected = 0.03 * sum(COSINE_LOBE[l] * (2 * l + 1) / (4 * np.pi) * Legendre.basis(l)(cosine) for l in range(BANDS))
    np.testing.assert_allclose(sh.irradiance(coefficients, normals)[:, 0], expected, atol=1e-15)


def test_radiance_comes_back_where_it_fits_the_bands():
    directions, weights = quadrature()
    function = 1 + directions[:, :1] * directions[:, 1:2] - directions[:, 2:] ** 3
    coefficients = sh.project(function, directions, weights, BANDS)
    at = random_directions(30)
    np.testing.assert_allclose(sh.radiance(coefficients, at), 1 + at[:, :1] * at[:, 1:2] - at[:, 2:] ** 3, atol=1e-13)


def test_cosine_lobe_is_its_integral():
    """A_l = 2π ∫₀¹ x P_l(x) dx (Ramamoorthi and Hanrahan 2001, eq. 8); the fourth is exactly zero."""
    for l in range(BANDS):
        integral = (Legendre.basis(l).convert(kind=Polynomial) * Polynomial([0, 1])).integ()
        assert COSINE_LOBE[l] == pytest.approx(2 * np.pi * (integral(1) - integral(0)), abs=1e-15)
    assert COSINE_LOBE[3] == 0
    assert (sh.cosine_lobe(BANDS) == COSINE_LOBE[[band_of(i) for i in range(16)]]).all()


def test_a_tabulated_transfer_agrees_with_the_analytic_one():
    """The 2007 system kept the diffuse transfer of every normal in four cubemaps: 16 numbers a texel, sampled. The same
    table, integrated over a fine cubemap, is A_l Y_lm(n), and its fourth band is zero."""
    face = 64
    directions = texel_directions(face).reshape(-1, 3)
    weights = np.tile(texel_solid_angles(face).ravel(), 6)
    normals = texel_directions(4).reshape(-1, 3)
    cosine = np.maximum(normals @ directions.T, 0)
    table = (cosine * weights) @ sh.basis(directions, BANDS)
    np.testing.assert_allclose(table, sh.basis(normals, BANDS) * sh.cosine_lobe(BANDS), atol=1e-3)
    light = np.random.default_rng(7).random((16, 3))
    expected = sh.irradiance(light, normals)
    np.testing.assert_allclose(table @ light, expected, atol=5e-3)
    np.testing.assert_allclose(table[:, 9:], 0, atol=1e-3)


def test_three_bands_carry_all_of_diffuse_light_that_four_do():
    light = np.random.default_rng(8).normal(size=(16, 3))
    normals = random_directions(20)
    np.testing.assert_allclose(sh.irradiance(light, normals), sh.irradiance(light[:9], normals), atol=1e-14)
