# SPDX-License-Identifier: GPL-3.0-or-later
"""Exported files in readers that are not ours: ktx-parse, three.js's EXRLoader and ObjectLoader."""

import base64
from pathlib import Path

import numpy as np
import pytest
from export_fields import PLACEMENTS, Y_UP, lit_field
from gridlight.core import spherical_harmonics as sh
from gridlight.formats.export import ExportOptions, export
from gridlight.formats.export_bevy import ambient_cubes
from gridlight.formats.export_lattice import axes_matrix, converted, right_handed

HERE = Path(__file__).parent


@pytest.mark.parametrize("precision", ["half", "float"])
def test_ktx2_in_ktx_parse(packages, node, tmp_path, precision):
    field = lit_field(*PLACEMENTS["straight"], linear=False)
    export(field, "bevy", tmp_path, ExportOptions(precision=precision))
    found = node(HERE / "read_ktx2.mjs", tmp_path / "probes.ktx2")
    nx, ny, nz = (3, 4, 5)  # Blender's resolution 3, 5, 4 with Y up
    assert found["size"] == [nx, 2 * ny, 3 * nz]
    size = 2 if precision == "half" else 4
    assert (found["format"], found["typeSize"]) == ((97, 2) if precision == "half" else (109, 4))
    assert (found["layers"], found["faces"], found["compression"], len(found["levels"])) == (0, 1, 0, 1)
    assert (found["model"], found["primaries"], found["transfer"], found["bytes"]) == (1, 1, 1, 4 * size)
    assert [sample["bitOffset"] for sample in found["samples"]] == [8 * size * channel for channel in range(4)]
    assert all(sample["bitLength"] == 8 * size - 1 for sample in found["samples"])
    assert found["writer"].startswith("Gridlight")
    texels = np.frombuffer(base64.b64decode(found["levels"][0]), f"<f{size}").reshape(3 * nz, 2 * ny, nx, 4)
    lattice = right_handed(converted(field, axes_matrix("y-up"), 1.0))
    expected = ambient_cubes(lattice.coefficients, lattice.grid.resolution)
    np.testing.assert_allclose(texels[..., :3], expected, rtol=2.0**-10)
    assert (texels[..., 3] == 1).all()


@pytest.mark.parametrize("precision", ["half", "float"])
def test_exr_in_threes_loader(packages, node, tmp_path, precision):
    """Rows come bottom up from this loader; ours are top down in the file."""
    field = lit_field(*PLACEMENTS["straight"], linear=False)
    export(field, "exr-flipbook", tmp_path / "book.exr", ExportOptions(precision=precision, axes="blender"))
    found = node(HERE / "read_exr.mjs", tmp_path / "book.exr")
    nx, ny, nz = field.grid.resolution
    assert (found["width"], found["height"]) == (nz * nx, 9 * ny)
    pixels = np.array(found["pixels"]).reshape(9 * ny, nz * nx, 4)[::-1]
    for node_index, (i, j, k) in enumerate(field.grid.lattice()):
        texels = pixels[j::ny, k * nx + i, :3]
        np.testing.assert_allclose(texels, field.coefficients[node_index], rtol=2.0**-10, atol=1e-4)


def test_a_light_probe_in_threes_object_loader(packages, node, tmp_path):
    field = lit_field(*PLACEMENTS["turned"], linear=False)
    export(field, "three-light", tmp_path / "light.json", ExportOptions(probe=(1, 2, 3)))
    node_index = 1 + 3 * (2 + 5 * 3)
    normals = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    found = node(HERE / "read_light_probe.mjs", tmp_path / "light.json", *(normals @ Y_UP.T).ravel())
    assert found["type"] == "LightProbe"
    np.testing.assert_allclose(found["position"], Y_UP @ field.grid.positions()[node_index], rtol=1e-6)
    expected = [sh.irradiance(field.coefficients[node_index], normal) for normal in normals]
    np.testing.assert_allclose(found["irradiance"], expected, rtol=1e-5, atol=1e-5)
