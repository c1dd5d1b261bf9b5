# SPDX-License-Identifier: GPL-3.0-or-later
"""Cubemap texels and the octahedral map: solid angles, inverses, and the layout that the conventions draw."""

import numpy as np
import pytest
from gridlight.core import cubemap
from gridlight.core.conventions import CUBE_TURN, FACE_FORWARD, FACE_RIGHT, FACE_UP
from hypothesis import given
from hypothesis import strategies as st

component = st.floats(-1, 1, allow_subnormal=False)


@pytest.mark.parametrize("face", [1, 2, 4, 5, 16, 31, 64, 128])
def test_solid_angles_sum_to_the_sphere(face):
    assert 6 * cubemap.texel_solid_angles(face).sum() == pytest.approx(4 * np.pi, rel=1e-13)


@pytest.mark.parametrize("face", [4, 16])
def test_a_texel_is_the_sum_of_its_quarters(face):
    fine = cubemap.texel_solid_angles(2 * face).reshape(face, 2, face, 2).sum(axis=(1, 3))
    np.testing.assert_allclose(cubemap.texel_solid_angles(face), fine, rtol=1e-12)


def test_solid_angles_against_the_projected_area():
    """dω = ds dt / (s² + t² + 1)^{3/2}; small texels are that at their centre."""
    face = 128
    centre = (np.arange(face) + 0.5) * 2 / face - 1
    s, t = np.meshgrid(centre, centre)
    np.testing.assert_allclose(
        cubemap.texel_solid_angles(face), (2 / face) ** 2 * (s * s + t * t + 1) ** -1.5, rtol=2e-4
    )


def test_faces_are_what_a_camera_sees():
    """right × up points back at the viewer, so that images are not mirrored."""
    np.testing.assert_allclose(np.cross(FACE_RIGHT, FACE_UP), -FACE_FORWARD, atol=1e-15)


def test_the_turn_of_cubes_is_a_rotation():
    np.testing.assert_allclose(CUBE_TURN @ CUBE_TURN.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(CUBE_TURN) == pytest.approx(1, rel=1e-15)
    turned = CUBE_TURN @ np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1.0]]).T
    np.testing.assert_allclose(np.stack([FACE_FORWARD[0], FACE_FORWARD[2], FACE_FORWARD[4]], axis=1), turned)
    assert np.abs(CUBE_TURN).max() < 0.9, "askew: no axis of the cube is near one of the world"


def test_layout_of_a_face():
    directions = cubemap.texel_directions(8)
    assert directions.shape == (6, 8, 8, 3)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=-1), 1, rtol=1e-15)
    for face in range(6):
        columns = directions[face, 4] @ FACE_RIGHT[face]
        rows = directions[face, :, 4] @ FACE_UP[face]
        assert (np.diff(columns) > 0).all() and (np.diff(rows) > 0).all()
        assert (directions[face] @ FACE_FORWARD[face] > 0.57).all()


@pytest.mark.parametrize("face", [1, 4, 5, 16, 128])
def test_texels_and_directions_are_inverses(face):
    expected = np.meshgrid(np.arange(6), np.arange(face), np.arange(face), indexing="ij")
    for found, index in zip(cubemap.direction_to_texel(cubemap.texel_directions(face), face), expected):
        np.testing.assert_array_equal(found, index)


@given(component, component, component)
def test_a_direction_lies_in_its_texel(x, y, z):
    direction = np.array([x, y, z])
    if np.abs(direction).max() < 1e-3:
        return
    face, row, column = cubemap.direction_to_texel(direction, 16)
    depth = direction @ FACE_FORWARD[face]
    s, t = direction @ FACE_RIGHT[face] / depth, direction @ FACE_UP[face] / depth
    assert abs(s - ((column + 0.5) / 8 - 1)) <= 1 / 16 + 1e-12
    assert abs(t - ((row + 0.5) / 8 - 1)) <= 1 / 16 + 1e-12


@given(component, component, component)
def test_octahedral_round_trip_of_directions(x, y, z):
    direction = np.array([x, y, z])
    length = np.linalg.norm(direction)
    if length < 1e-3:
        return
    uv = cubemap.octahedral_encode(direction / length)
    assert (np.abs(uv) <= 1 + 1e-15).all()
    np.testing.assert_allclose(cubemap.octahedral_decode(uv), direction / length, atol=1e-12)


@given(component, component)
def test_octahedral_round_trip_of_coordinates(u, v):
    uv = np.array([u, v])
    if (
        abs(abs(u) + abs(v) - 1) < 1e-9
        or max(abs(u), abs(v)) > 1 - 1e-9
        or (abs(u) + abs(v) > 1 and min(abs(u), abs(v)) < 1e-9)
    ):
        return  # on the folds two coordinates name one direction
    np.testing.assert_allclose(cubemap.octahedral_encode(cubemap.octahedral_decode(uv)), uv, atol=1e-9)


@pytest.mark.parametrize(
    "direction", np.concatenate([np.eye(3), -np.eye(3), [[1, 1, 0], [-1, 0, -1], [0, -1, -1], [1, -1, -1]]])
)
def test_octahedral_axes_and_diagonals(direction):
    direction = direction / np.linalg.norm(direction)
    np.testing.assert_allclose(cubemap.octahedral_decode(cubemap.octahedral_encode(direction)), direction, atol=1e-15)


def test_octahedral_layout():
    """The upper half sphere is the inner diamond: +Z in the middle, +X to the right, +Y up, −Z in all four corners."""
    np.testing.assert_array_equal(
        cubemap.octahedral_encode(np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])), [[0, 0], [1, 0], [0, 1]]
    )
    corners = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    np.testing.assert_allclose(cubemap.octahedral_decode(corners), np.tile([0, 0, -1], (4, 1)), atol=1e-15)
