# SPDX-License-Identifier: GPL-3.0-or-later
"""Tiles of a picture list every sphere that one of their rays meets, and few others."""

from dataclasses import replace

import numpy as np
import pytest
from gridlight.core.camera import look
from gridlight.core.sphere_tiles import TILE, tiled_spheres

pytestmark = pytest.mark.any_version
WIDTH, HEIGHT = 75, 41  # no multiples of a tile
ASPECT = WIDTH / HEIGHT


def cameras():
    plain = look((0.2, -0.3, 0.1), (2.0, 1.0, 0.4), ASPECT, 0.7)
    shifted = replace(plain, forward=plain.forward + 0.6 * plain.right - 0.3 * plain.up)
    parallel = replace(plain, orthographic=True, right=1.5 * plain.right, up=1.5 * plain.up)
    return {"plain": plain, "shifted": shifted, "parallel": parallel}


def met(spheres, radii, camera):
    """(H, W, S) bool: does the ray through the pixel's corners or middle meet the sphere's line?"""
    y, x = (np.indices((2 * HEIGHT + 1, 2 * WIDTH + 1)) / np.array([HEIGHT, WIDTH])[:, None, None]) - 1
    across = x[..., None] * camera.right + y[..., None] * camera.up
    origin = camera.position + (across if camera.orthographic else 0)
    direction = camera.forward + (0 if camera.orthographic else across)
    direction = np.broadcast_to(direction / np.linalg.norm(direction, axis=-1, keepdims=True), across.shape)
    offset = spheres[:, :3] - np.broadcast_to(origin, across.shape)[..., None, :]
    along = np.einsum("hwsc,hwc->hws", offset, direction)
    reach = np.sqrt(np.maximum(radii**2 - (offset**2).sum(axis=-1) + along**2, 0))
    hit = ((offset**2).sum(axis=-1) - along**2 <= radii**2) & (camera.orthographic | (along + reach > 0))
    corners = [hit[i : i + 2 * HEIGHT - 1 : 2, j : j + 2 * WIDTH - 1 : 2] for i in range(3) for j in range(3)]
    return np.any(corners, axis=0)


@pytest.mark.parametrize("name", cameras())
def test_tiles_list_what_their_rays_meet(name):
    camera = cameras()[name]
    rng = np.random.default_rng(5)
    spheres = np.c_[rng.uniform(-3, 3, (200, 3)), np.arange(200)].astype(np.float32)
    radii = rng.uniform(0.02, 0.3, 200)
    rows = tiled_spheres(spheres, radii, camera, WIDTH, HEIGHT)
    columns, lines = -(-WIDTH // TILE), -(-HEIGHT // TILE)
    hit, listed = met(spheres, radii, camera), np.zeros((lines, columns, 200), bool)
    for tile, (first, number, *_) in enumerate(rows[: columns * lines].astype(int)):
        found = rows[first : first + number]
        np.testing.assert_array_equal(found, spheres[found[:, 3].astype(int)])
        assert (np.diff(found[:, 3]) > 0).all()
        listed[tile // columns, tile % columns, found[:, 3].astype(int)] = True
    needed = np.zeros_like(listed)
    for line in range(lines):
        for column in range(columns):
            part = hit[TILE * line : TILE * (line + 1), TILE * column : TILE * (column + 1)]
            needed[line, column] = part.any(axis=(0, 1))
    assert needed.any() and not needed.all()
    assert not (needed & ~listed).any()
    beside = np.abs((spheres[:, :3] - camera.position) @ np.cross(camera.right, camera.up)) < 0.3 * np.linalg.norm(
        np.cross(camera.right, camera.up)
    )  # of the eye: these are asked everywhere
    listed &= camera.orthographic | ~beside
    assert listed.sum() < 2.5 * needed.sum()


def test_a_sphere_around_the_eye_is_everywhere_and_one_behind_nowhere():
    camera = cameras()["plain"]
    around, behind = camera.position + [0.1, 0, 0], camera.position - 2 * camera.forward
    spheres = np.c_[np.stack([around, behind]), [7.0, 8.0]]
    rows = tiled_spheres(spheres, np.array([0.3, 0.5]), camera, WIDTH, HEIGHT)
    tiles = -(-WIDTH // TILE) * -(-HEIGHT // TILE)
    np.testing.assert_array_equal(rows[:tiles, 1], 1)
    np.testing.assert_array_equal(rows[tiles:, 3], 7)


def test_no_spheres():
    rows = tiled_spheres(np.zeros((0, 4)), np.zeros(0), cameras()["plain"], WIDTH, HEIGHT)
    assert not rows[:, 1].any()
