# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of ``verify``: its maps show the points where they are, and the scene's outlines without its diagonals."""

import re
from html.parser import HTMLParser

import numpy as np
from gridlight.core import measures
from gridlight.core.grid import Grid
from gridlight.core.snapshot import Material, SceneSnapshot, World
from gridlight.formats.report_errors import KindOfPoints, errors_html, outlines


def box_snapshot(turned=False):
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 2) for x in (0, 3)], float)
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return SceneSnapshot(
        vertices=corners,
        triangles=triangles[:, ::-1] if turned else triangles,
        corner_normals=np.zeros((12, 3, 3), np.float32),
        corner_uvs=np.zeros((12, 3, 2), np.float32),
        material_index=np.zeros(12, np.int32),
        object_index=np.zeros(12, np.int32),
        object_names=["box"],
        materials=[Material("grey")],
        images=[],
        lights=[],
        world=World(),
    )


def kind(name="free <points>", count=5):
    generator = np.random.default_rng(1)
    reference = np.ones((count, 6, 3))
    measured = reference + 0.02 * generator.normal(size=reference.shape)
    error = measures.compare(measured, reference)
    errors, biases = measures.point_errors(measured, reference, error.scale)
    none = measures.count_negative(measured, error.scale)
    return KindOfPoints(
        name, generator.uniform(0, 1, (count, 3)), errors, biases, error, error, None, 0.001, none, none
    )


def test_outlines_of_a_box_are_its_twelve_edges():
    for turned in (False, True):
        edges = outlines(box_snapshot(turned))
        assert edges.shape == (12, 2, 3)
        lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
        np.testing.assert_allclose(lengths, [3] * 4 + [2] * 4 + [1] * 4)


def test_every_point_is_in_every_view_and_the_worst_is_ringed():
    grid = Grid.from_bounds((0, 0, 0), (1, 1, 1), (2, 2, 2))
    text = errors_html("Room & <more>", ["fact"], [kind()], grid, outlines(box_snapshot()), 3, ["<careful>"])
    HTMLParser().feed(text)
    assert text.count("<circle") == 3 * 6
    assert "<careful>" not in text and "free <points>" not in text and "<more>" not in text
    for x in re.findall(r'cx="([^"]+)"', text):
        assert 0 <= float(x) <= 450


def test_a_point_without_error_and_a_scene_without_edges():
    grid = Grid.from_bounds((0, 0, 0), (1, 1, 1), (1, 1, 1))
    one = kind(count=1)
    perfect = KindOfPoints(one.name, one.positions, np.zeros(1), np.zeros(1), *list(vars(one).values())[4:])
    with np.errstate(all="raise"):
        text = errors_html("t", [], [perfect], grid, np.zeros((0, 2, 3)), 3, [])
    assert "nan" not in text
