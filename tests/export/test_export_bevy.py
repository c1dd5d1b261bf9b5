# SPDX-License-Identifier: GPL-3.0-or-later
"""Bevy: the KTX2 file, sampled as irradiance_volume.wgsl samples it, against ``eval``.

Ambient cubes hold six sides; for normals along the axes they must agree with ``eval``, in between they cannot.
tests/web opens the same file with an independent parser.
"""

import json
import struct

import numpy as np
import pytest
from export_fields import PLACEMENTS, Y_UP, box, lit_field, places_inside, sample_volume
from gridlight.core import lookup
from gridlight.formats.export import ExportOptions, export
from gridlight.formats.export_bevy import quaternion

AXES = np.concatenate([np.eye(3), -np.eye(3)])


def read_ktx2(path):
    """(depth, height, width, 4) texels, by the offsets of the specification."""
    data = path.read_bytes()
    assert data[:12] == b"\xabKTX 20\xbb\r\n\x1a\n"
    kind, size, width, height, depth, layers, faces, levels, compression = struct.unpack_from("<9I", data, 12)
    assert (layers, faces, levels, compression) == (0, 1, 1, 0)
    assert (kind, size) in {(97, 2), (109, 4)}
    offset, length, raw_length = struct.unpack_from("<3Q", data, 80)
    assert offset % (4 * size) == 0 and offset + length == len(data) and length == raw_length
    texels = np.frombuffer(data, f"<f{size}", offset=offset)
    return texels.reshape(depth, height, width, 4).astype(float)


class BevyVolume:
    def __init__(self, folder):
        self.texture = read_ktx2(folder / "probes.ktx2")
        conventions = json.loads((folder / "probes.conventions.json").read_text())
        transform = conventions["layout"]["transform"]
        x, y, z, w = transform["rotation_xyzw"]
        turn = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
        self.to_local = np.linalg.inv(np.array(turn) * transform["scale"])
        self.center = np.array(transform["translation"])

    def irradiance(self, points, normals):
        """π times irradiance_volume_light, line by line."""
        atlas = np.array(self.texture.shape[2::-1])
        resolution = atlas // [1, 2, 3]
        unit = (points - self.center) @ self.to_local.T
        assert (np.abs(unit) <= 0.5 + 1e-9).all()
        place = np.clip((unit + 0.5) * resolution, 0.5, resolution - 0.5)
        uvw = place / atlas
        result = 0
        for axis in range(3):
            shift = np.zeros_like(uvw)
            shift[:, 1] = np.where(normals[:, axis] < 0, 0.5, 0.0)
            shift[:, 2] = axis / 3
            result = result + sample_volume(self.texture, uvw + shift)[:, :3] * normals[:, axis, None] ** 2
        return np.pi * result


def exported(field, folder, **options):
    result = export(field, "bevy", folder, ExportOptions(**options))
    return result, BevyVolume(folder)


@pytest.mark.parametrize("precision", ["half", "float"])
@pytest.mark.parametrize("linear", [True, False], ids=["linear", "random"])
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_agrees_with_eval_along_the_axes(tmp_path, placement, linear, precision):
    """Also in turned and mirrored volumes, without resampling: Bevy knows rotation."""
    field = lit_field(*PLACEMENTS[placement], linear=linear)
    result, volume = exported(field, tmp_path, precision=precision)
    assert result.conventions["resampled"] is None
    points = places_inside(field.grid, 120)[0]
    normals = AXES[np.arange(120) % 6]
    expected = lookup.irradiance(field, points, normals @ Y_UP)
    found = volume.irradiance(points @ Y_UP.T, normals)
    np.testing.assert_allclose(found, expected, atol=expected.max() * (2.0**-10 if precision == "half" else 1e-5))


def test_between_the_axes_it_is_close(tmp_path):
    """What the ambient cube costs on light from six sides at once; docs/export.md states it."""
    field = lit_field(*PLACEMENTS["straight"])
    _result, volume = exported(field, tmp_path)
    points, normals = places_inside(field.grid, 2000)
    expected = lookup.irradiance(field, points, normals)
    found = volume.irradiance(points @ Y_UP.T, normals @ Y_UP.T)
    assert np.sqrt(np.mean((found - expected) ** 2) / np.mean(expected**2)) < 0.1


def test_a_sheared_volume_is_laid_straight(tmp_path):
    matrix = box((4, 6, 3))
    matrix[0, 1] = 1.0
    field = lit_field(matrix, (4, 5, 3))
    result, volume = exported(field, tmp_path, precision="float")
    assert result.conventions["resampled"] and any("rotated" in warning for warning in result.warnings)
    points = places_inside(field.grid, 60, share=0.3)[0]
    normals = AXES[np.arange(60) % 6]
    expected = lookup.irradiance(field, points, normals @ Y_UP)
    np.testing.assert_allclose(volume.irradiance(points @ Y_UP.T, normals), expected, rtol=2e-2)


def test_negative_irradiance_is_cut(tmp_path):
    field = lit_field(*PLACEMENTS["straight"])
    field.coefficients[:, 0] = 0.01
    _result, volume = exported(field, tmp_path)
    assert volume.texture.min() == 0


def test_quaternions_turn_as_their_matrices():
    rng = np.random.default_rng(2)
    for _ in range(50):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        turn *= np.sign(np.linalg.det(turn))
        *v, w = quaternion(turn)
        point = rng.normal(size=3)
        turned = point + 2 * np.cross(v, np.cross(v, point) + w * point)
        np.testing.assert_allclose(turned, turn @ point, atol=1e-12)
