# SPDX-License-Identifier: GPL-3.0-or-later
"""Exports in the real three.js, in headless Chromium: the pixels of the viewer's page against ``eval``.

three.js looks half a cell along the normal before it interpolates, and knows nothing of visibility. So the two must
agree where three.js looks, in a field in which nothing hides anything.
"""

from pathlib import Path

import numpy as np
import pytest
from export_fields import PLACEMENTS, Y_UP, lit_field
from gridlight.core import lookup
from gridlight.formats.export import ExportOptions, export
from viewer_pixels import measured, where_it_looks

HERE = Path(__file__).parent


@pytest.mark.parametrize(("placement", "linear"), [("straight", False), ("turned", True)])
def test_the_viewers_pixels_agree_with_eval(browse, tmp_path, placement, linear):
    matrix = PLACEMENTS[placement][0]
    field = lit_field(matrix, (5, 7, 6), linear=linear)
    about = export(field, "three", tmp_path, ExportOptions()).conventions["layout"]
    places, normals, found = measured(browse, tmp_path, reach=0.9)
    points, among = where_it_looks(places, normals, about)
    if placement == "turned":  # only where the straight box's nodes lie in the old one
        local = (points - field.grid.center) @ np.linalg.inv(field.grid.matrix[:3, :3]).T
        among &= (np.abs(local) < 0.6).all(axis=1)
    assert among.sum() >= 200
    expected = lookup.irradiance(field, points[among], normals[among] @ Y_UP)
    np.testing.assert_allclose(found[among], expected, rtol=0.02)
    error = np.sqrt(np.mean((found[among] - expected) ** 2) / np.mean(expected**2))
    assert error < 5e-4, "half floats in the atlas, single precision in the shader"


def test_the_loader_works_with_the_webgpu_renderer(browse, tmp_path):
    field = lit_field(PLACEMENTS["straight"][0], (4, 3, 5), linear=False)
    about = export(field, "three", tmp_path, ExportOptions(precision="float")).conventions["layout"]
    result = browse(tmp_path, "webgpu.html", {"webgpu.html": HERE / "webgpu.html"})
    rows = np.array(result["rows"])
    points, among = where_it_looks(rows[:, :3], rows[:, 3:6], about)
    assert among.sum() >= 100
    expected = lookup.irradiance(field, points[among], rows[among, 3:6] @ Y_UP)
    np.testing.assert_allclose(np.pi * rows[among, 6:9], expected, rtol=0.01)
