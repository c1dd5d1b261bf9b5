# SPDX-License-Identifier: GPL-3.0-or-later
"""EXR files read by OpenImageIO: the probe file itself, the flipbook, and pictures of single probes."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from export_fields import PLACEMENTS, Y_UP, lit_field, places_inside
from gridlight.core import lookup
from gridlight.core import spherical_harmonics as sh
from gridlight.core.conventions import ACTIVE, coefficient_names
from gridlight.core.errors import InputError
from gridlight.core.panorama import panorama_coordinates
from gridlight.formats import probe_file
from gridlight.formats.export import ExportOptions, export


def read_image(path):
    """(names, pixels (height, width, channels), kind, gridlight attribute) by OpenImageIO."""
    result = path.with_suffix(".npz")
    reader = Path(__file__).with_name("image_reader.py")
    done = subprocess.run([sys.executable, "-I", reader, path, result], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = np.load(result)
    return list(found["names"]), found["pixels"], str(found["kind"]), str(found["gridlight"])


def test_another_reader_finds_the_probe_files_numbers(tmp_path):
    field = lit_field(*PLACEMENTS["turned"], linear=False)
    probe_file.write(tmp_path / "probes.exr", field)
    names, pixels, kind, attribute = read_image(tmp_path / "probes.exr")
    nx, ny, nz = field.grid.resolution
    assert pixels.shape[:2] == (ny * nz, nx) and kind == "float"
    assert json.loads(attribute)["resolution"] == [nx, ny, nz]
    for index, name in enumerate(coefficient_names(3)):
        for color, letter in enumerate("RGB"):
            plane = pixels[..., names.index(f"{name}.{letter}")]
            assert np.array_equal(plane.ravel(), field.coefficients[:, index, color])
    assert np.array_equal(pixels[..., names.index("state")].ravel(), field.state)


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("bands", [2, 4])
def test_a_flipbook_gives_back_every_probe(tmp_path, placement, bands):
    field = lit_field(*PLACEMENTS[placement], bands=bands, linear=False)
    layout = export(field, "exr-flipbook", tmp_path / "book.exr", ExportOptions()).conventions["layout"]
    names, pixels, kind, _ = read_image(tmp_path / "book.exr")
    assert names == ["R", "G", "B", "A"] and kind == "half"
    nx, ny, nz = layout["resolution"]
    assert pixels.shape == (bands * bands * ny, nz * nx, 4) and layout["rows_of_tiles"] == coefficient_names(bands)
    matrix = np.array(layout["matrix"])
    normals = places_inside(field.grid, nx * ny * nz)[1]
    points, light, active = [], [], []
    for k, j, i in np.ndindex(nz, ny, nx):
        texels = pixels[j::ny, k * nx + i]  # one per coefficient
        light.append(texels[:, :3])
        active.append(texels[0, 3])
        points.append(matrix[:3, :3] @ (2 * np.array([i, j, k]) / (np.array([nx, ny, nz]) - 1) - 1) + matrix[:3, 3])
    points = np.array(points) @ Y_UP
    expected = lookup.irradiance(field, points, normals)
    found = sh.irradiance(np.array(light), normals @ Y_UP.T)
    np.testing.assert_allclose(found, expected, atol=expected.max() * 2.0**-10)
    nearest = np.abs(field.grid.positions()[:, None] - points).sum(axis=2).argmin(axis=0)
    assert np.array_equal(np.array(active) == 1, field.state[nearest] == ACTIVE)


def brightest(pixels):
    """(3, 2) row and column of the brightest pixel of each colour."""
    return [np.unravel_index(pixels[..., color].argmax(), pixels.shape[:2]) for color in range(3)]


def test_six_faces_show_light_where_it_comes_from(tmp_path):
    """Red from Blender's +X, green from +Y, blue from +Z: in Y-up faces +X, -Z and +Y, in the middle of each."""
    field = lit_field(*PLACEMENTS["straight"], bands=4)
    options = ExportOptions(layout="faces", size=9)
    result = export(field, "cubemap", tmp_path / "probe.exr", options)
    assert len(result.files) == 7
    faces = {name: read_image(tmp_path / f"probe_{name}.exr")[1] for name in ("px", "nx", "py", "ny", "pz", "nz")}
    for color, name in ((0, "px"), (1, "nz"), (2, "py")):
        assert max(faces, key=lambda face: faces[face][..., color].max()) == name
        row, column = brightest(faces[name])[color]
        assert abs(row - 4) <= 1 and abs(column - 4) <= 1


def face_direction(name, row, column, size):
    """Direction through a texel as the OpenGL specification's table of cube map faces has it (sc, tc, ma)."""
    s, t = 2 * (column + 0.5) / size - 1, 2 * (row + 0.5) / size - 1
    table = {
        "px": (1, -t, -s),
        "nx": (-1, -t, s),
        "py": (s, 1, t),
        "ny": (s, -1, -t),
        "pz": (s, -t, 1),
        "nz": (-s, -t, -1),
    }
    direction = np.array(table[name])
    return direction / np.linalg.norm(direction)


def test_faces_and_cross_hold_the_same_radiance(tmp_path):
    field = lit_field(*PLACEMENTS["turned"], bands=4, linear=False)
    for layout in ("faces", "cross"):
        options = ExportOptions(layout=layout, size=5, probe=(1, 2, 3), precision="float")
        export(field, "cubemap", tmp_path / f"{layout}.exr", options)
    cross = read_image(tmp_path / "cross.exr")[1]
    assert cross.shape == (15, 20, 3) and not cross[:5, :5].any() and not cross[10:, 10:].any()
    node = 1 + 3 * (2 + 5 * 3)
    places = {"nx": (1, 0), "pz": (1, 1), "px": (1, 2), "nz": (1, 3), "py": (0, 1), "ny": (2, 1)}
    for name, (row, column) in places.items():
        face = read_image(tmp_path / f"faces_{name}.exr")[1]
        assert np.array_equal(face, cross[5 * row : 5 * row + 5, 5 * column : 5 * column + 5])
        for y, x in ((0, 0), (1, 3), (4, 2)):
            direction = face_direction(name, y, x, 5) @ Y_UP
            expected = np.maximum(sh.radiance(field.coefficients[node], direction), 0)
            np.testing.assert_allclose(face[y, x], expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("axes", [None, "blender", "unity", "y,-z,x"])
def test_a_panorama_is_blenders_environment_texture_whatever_the_axes(tmp_path, axes):
    field = lit_field(*PLACEMENTS["turned"], bands=4, linear=False)
    options = ExportOptions(layout="equirect", size=8, probe=(0, 0, 0), axes=axes, precision="float")
    export(field, "cubemap", tmp_path / "sky.exr", options)
    pixels = read_image(tmp_path / "sky.exr")[1]
    assert pixels.shape == (8, 16, 3)
    rng = np.random.default_rng(1)
    for row, column in rng.integers(0, [8, 16], (20, 2)):
        u, v = (column + 0.5) / 16, 1 - (row + 0.5) / 8
        around, up = np.pi * (1 - 2 * u), np.pi * (v - 0.5)
        direction = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
        np.testing.assert_allclose(panorama_coordinates(direction), [u, v], atol=1e-12)
        expected = np.maximum(sh.radiance(field.coefficients[0], direction), 0)
        np.testing.assert_allclose(pixels[row, column], expected, rtol=1e-5, atol=1e-6)


def test_the_middle_probe_is_the_default_and_others_are_checked(tmp_path):
    field = lit_field(*PLACEMENTS["straight"])
    field.state[:] = ACTIVE
    layout = export(field, "cubemap", tmp_path, ExportOptions(size=2)).conventions["layout"]
    assert layout["probe"] in ([1, 2, 1], [1, 2, 2])
    for probe in ((3, 0, 0), (0, -1, 0)):
        with pytest.raises(InputError, match="3 × 5 × 4 probes, counted from 0"):
            export(field, "cubemap", tmp_path, ExportOptions(probe=probe))
    field.state[:] = 0
    with pytest.raises(InputError, match="no probe is active"):
        export(field, "cubemap", tmp_path, ExportOptions())
