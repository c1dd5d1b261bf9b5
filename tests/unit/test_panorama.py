# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramas against closed forms."""

import numpy as np
import pytest
from gridlight.core.panorama import (
    panorama_coordinates,
    panorama_directions,
    panorama_irradiance,
    panorama_solid_angles,
    project_panorama,
)
from gridlight.core.spherical_harmonics import basis

NORMALS = np.array([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0], [0.6, 0, 0.8]], float)


@pytest.mark.parametrize("size", [(1, 1), (8, 4), (128, 64), (37, 19)])
def test_solid_angles_sum_to_the_sphere(size):
    assert panorama_solid_angles(*size).sum() == pytest.approx(4 * np.pi, rel=1e-13)


def test_a_pixel_at_the_pole_has_the_cap_share():
    expected = 2 * np.pi * (1 - np.cos(np.pi / 4)) / 8
    assert panorama_solid_angles(8, 4)[0, 0] == pytest.approx(expected, rel=1e-13)


def test_directions_are_unit_and_laid_out_as_documented():
    directions = panorama_directions(64, 32)
    assert np.allclose(np.linalg.norm(directions, axis=-1), 1, atol=1e-14)
    assert directions[0, :, 2].max() < -0.99 and directions[-1, :, 2].min() > 0.99
    middle = directions[16]
    assert middle[0, 0] < -0.99  # left edge −X
    assert middle[16, 1] > 0.99  # a quarter +Y
    assert middle[32, 0] > 0.99  # middle +X


def test_coordinates_invert_directions():
    width, height = 20, 10
    coordinates = panorama_coordinates(3.7 * panorama_directions(width, height))
    columns, rows = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    assert np.allclose(coordinates[..., 0], columns, atol=1e-12)
    assert np.allclose(coordinates[..., 1], rows, atol=1e-12)


@pytest.mark.parametrize("size", [(16, 8), (128, 64)])
def test_uniform_radiance(size):
    image = np.full((size[1], size[0], 3), [1.0, 2.0, 3.0])
    coefficients = project_panorama(image, 4)
    assert np.allclose(coefficients[0], np.sqrt(4 * np.pi) * np.array([1, 2, 3]), rtol=1e-12)
    assert np.abs(coefficients[1:, 0]).max() < 1e-4
    assert np.allclose(panorama_irradiance(image, NORMALS), np.pi * np.array([1, 2, 3]), rtol=1e-4)


def test_projection_recovers_each_basis_function():
    values = basis(panorama_directions(256, 128), 3)
    for index in range(9):
        coefficients = project_panorama(np.repeat(values[..., index : index + 1], 3, axis=2), 3)
        assert np.allclose(coefficients[:, 0], np.eye(9)[index], atol=1e-3)


def test_irradiance_of_half_a_sky_has_no_truncation_error():
    image = np.zeros((64, 128, 3))
    image[32:] = 1.0  # the upper hemisphere
    irradiance = panorama_irradiance(image, NORMALS)[:, 0]
    # A hemisphere tilted by θ against the normal gives π (1 + cos θ) / 2.
    assert np.allclose(irradiance, np.pi * (1 + NORMALS[:, 2]) / 2, atol=2e-4)


def test_irradiance_of_one_pixel_is_its_solid_angle_times_the_cosine():
    image = np.zeros((32, 64, 3))
    image[20, 11] = 5.0
    direction = panorama_directions(64, 32)[20, 11]
    expected = 5.0 * panorama_solid_angles(64, 32)[20, 11]
    assert panorama_irradiance(image, direction[None])[0, 1] == pytest.approx(expected, rel=2e-3)
    assert panorama_irradiance(image, -direction[None])[0, 1] == 0
