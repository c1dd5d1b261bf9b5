# SPDX-License-Identifier: GPL-3.0-or-later
"""Unity: the JSON, interpolated as the editor script does it and shaded as Unity's shader library does it."""

import json

import numpy as np
import pytest
from export_fields import PLACEMENTS, UNITY, lit_field, places_inside
from gridlight.core import lookup
from gridlight.formats.export import ExportOptions, export


class UnityProbes:
    def __init__(self, path):
        self.about = json.loads(path.read_text())
        assert self.about["format"] == "gridlight-unity" and self.about["version"] == 1
        self.resolution = np.array(self.about["resolution"])
        self.to_lattice = np.array(self.about["worldToLattice"], np.float32).reshape(3, 4)
        self.positions = np.array(self.about["positions"], np.float32).reshape(-1, 3)
        self.sh = np.array(self.about["coefficients"], np.float32).reshape(-1, 3, 9)

    def sampled(self, position):
        """(3, 9), as GridlightProbeImporter.Sample."""
        place = self.to_lattice[:, :3] @ position + self.to_lattice[:, 3]
        last = self.resolution - 1
        assert (place >= -0.5).all() and (place <= last + 0.5).all()
        place = np.clip(place, 0, last)
        cell = np.clip(place.astype(int), 0, np.maximum(last - 1, 0))
        share = place - cell
        result = np.zeros((3, 9))
        for corner in range(8):
            step = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
            node = np.minimum(cell + step, last) @ [1, self.resolution[0], self.resolution[0] * self.resolution[1]]
            result += np.where(step, share, 1 - share).prod() * self.sh[node]
        return result

    @staticmethod
    def irradiance(sh, normal):
        """π times ShadeSH9: unity_SHAr … unity_SHC from the coefficients, then SHEvalLinearL0L1 and L2."""
        x, y, z = normal
        result = []
        for c in sh:
            first = np.array([c[3], c[1], c[2], c[0] - c[6]]) @ [x, y, z, 1]
            second = np.array([c[4], c[5], c[6] * 3, c[7]]) @ [x * y, y * z, z * z, z * x]
            result.append(np.pi * (first + second + c[8] * (x * x - y * y)))
        return result


@pytest.mark.parametrize("precision", ["half", "float"])
@pytest.mark.parametrize("linear", [True, False], ids=["linear", "random"])
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_agrees_with_eval(tmp_path, placement, linear, precision):
    field = lit_field(*PLACEMENTS[placement], linear=linear)
    export(field, "unity", tmp_path / "probes.json", ExportOptions(precision=precision))
    probes = UnityProbes(tmp_path / "probes.json")
    np.testing.assert_allclose(probes.positions, field.grid.positions() @ UNITY.T, rtol=1e-6, atol=1e-6)
    points, normals = places_inside(field.grid, 200)
    found = [
        probes.irradiance(probes.sampled(point), normal) for point, normal in zip(points @ UNITY.T, normals @ UNITY.T)
    ]
    expected = lookup.irradiance(field, points, normals)
    np.testing.assert_allclose(found, expected, atol=expected.max() * (2.0**-10 if precision == "half" else 1e-5))


def test_space_is_left_handed_with_y_up(tmp_path):
    field = lit_field(*PLACEMENTS["straight"])
    conventions = export(field, "unity", tmp_path, ExportOptions()).conventions
    assert conventions["space"]["handedness"] == "left"
    assert conventions["space"]["x_y_z_are_blenders"] == ["-x", "+z", "-y"]


def test_the_script_comes_along_and_reads_what_is_written(tmp_path):
    """Its fields must bear the JSON's names: Unity's JsonUtility leaves a field it does not find empty, silently."""
    import re

    export(lit_field(*PLACEMENTS["straight"]), "unity", tmp_path, ExportOptions())
    script = (tmp_path / "GridlightProbeImporter.cs").read_text()
    block = re.search(r"class Probes\s*{(.*?)}", script, re.S).group(1)
    fields = re.findall(r"public \S+ (\w+);", block)
    assert len(fields) == 7 and set(fields) <= set(json.loads((tmp_path / "probes.json").read_text()))
