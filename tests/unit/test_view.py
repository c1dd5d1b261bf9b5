# SPDX-License-Identifier: GPL-3.0-or-later
"""Views: what the rays through an image meet is what the matrix projects back to the same place."""

import numpy as np
import pytest
from gridlight.core.camera import Camera, look
from gridlight.core.view import View


def project(view, points):
    clip = np.c_[points, np.ones(len(points))] @ view.to_clip.T
    return clip[:, :3] / clip[:, 3:]


def points_through(view, places, distances):
    camera = view.camera
    across = places[:, :1] * camera.right + places[:, 1:] * camera.up
    if camera.orthographic:
        return camera.position + across + distances[:, None] * camera.forward
    return camera.position + distances[:, None] * (camera.forward + across)


def perspective(x=0.0, y=0.0, focal=(1.7, 2.3), near=0.1, far=100.0):
    window = np.zeros((4, 4))
    window[0, 0], window[1, 1], window[0, 2], window[1, 2] = *focal, x, y
    window[2, 2:] = -(far + near) / (far - near), -2 * far * near / (far - near)
    window[3, 2] = -1
    return window


def parallel(x=0.0, y=0.0, scale=(0.3, 0.5), near=-50.0, far=100.0):
    window = np.diag([*scale, -2 / (far - near), 1.0])
    window[:3, 3] = x, y, -(far + near) / (far - near)
    return window


def some_view_matrix():
    camera = look((3.0, -2.0, 1.5), (-0.4, 0.3, 0.2), 1.0)
    to_world = np.eye(4)
    to_world[:3, 0] = camera.right / np.linalg.norm(camera.right)
    to_world[:3, 1] = camera.up / np.linalg.norm(camera.up)
    to_world[:3, 2] = -camera.forward
    to_world[:3, 3] = camera.position
    return np.linalg.inv(to_world)


VIEWS = {
    "perspective": lambda: View.from_matrices(some_view_matrix(), perspective()),
    "shifted perspective": lambda: View.from_matrices(some_view_matrix(), perspective(0.4, -0.7)),
    "parallel": lambda: View.from_matrices(some_view_matrix(), parallel()),
    "shifted parallel": lambda: View.from_matrices(some_view_matrix(), parallel(0.6, -0.2)),
    "from a camera": lambda: View.from_camera(look((3, -2, 1), (0, 0, 0), 16 / 9), 0.1, 50.0),
    "from a parallel camera": lambda: View.from_camera(
        Camera(np.array([1.0, 2, 3]), np.array([2.0, 0, 0]), np.array([0, 1.0, 0]), np.array([0, 0, -1.0]), True),
        0.1,
        50.0,
    ),
}


@pytest.mark.parametrize("name", VIEWS)
def test_rays_and_matrix_agree(name):
    view = VIEWS[name]()
    generator = np.random.default_rng(0)
    places, distances = generator.uniform(-1, 1, (200, 2)), generator.uniform(0.5, 20, 200)
    found = project(view, points_through(view, places, distances))
    np.testing.assert_allclose(found[:, :2], places, atol=1e-12)
    assert (np.diff(found[np.argsort(distances), 2]) > 0).all(), "farther is deeper"


@pytest.mark.parametrize("name", VIEWS)
def test_another_origin_is_the_same_view(name):
    view, origin = VIEWS[name](), np.array([5.0, -3.0, 2.0])
    points = np.random.default_rng(1).normal(size=(50, 3))
    np.testing.assert_allclose(project(view.relative_to(origin), points - origin), project(view, points), atol=1e-9)


def test_near_and_far_are_the_ends_of_depth():
    view = View.from_camera(look((0, 0, 0), (1, 0, 0), 1.0), 0.25, 40.0)
    ends = project(view, np.array([[0.25, 0, 0], [40.0, 0, 0]]))
    np.testing.assert_allclose(ends[:, 2], [-1, 1], atol=1e-12)


def test_angular_width_of_a_pixel():
    camera = look((0, 0, 0), (1, 0, 0), 2.0, half_angle=0.5)
    width = View.from_camera(camera, 0.1, 10).angular_width(100)
    assert width == pytest.approx(2 * np.tan(0.5) / 2.0 / 100)
