# SPDX-License-Identifier: GPL-3.0-or-later
"""One probe for three.js and Filament, shaded as their sources do it, against the probe's own irradiance."""

import json
import re

import numpy as np
import pytest
from export_fields import PLACEMENTS, Y_UP, lit_field, places_inside
from gridlight.core import spherical_harmonics as sh
from gridlight.formats.export import ExportOptions, export

PROBE = (1, 2, 3)


def three_irradiance(c, normal):
    """``shGetIrradianceAt`` of three.js's lights_pars_begin, times nothing: irradiance."""
    x, y, z = normal
    result = c[0] * 0.886227
    result = result + c[1] * 2.0 * 0.511664 * y + c[2] * 2.0 * 0.511664 * z + c[3] * 2.0 * 0.511664 * x
    result = result + c[4] * 2.0 * 0.429043 * x * y + c[5] * 2.0 * 0.429043 * y * z
    result = result + c[6] * (0.743125 * z * z - 0.247708)
    return result + c[7] * 2.0 * 0.429043 * x * z + c[8] * 0.429043 * (x * x - y * y)


def filament_irradiance(c, normal):
    """π times ``Irradiance_SphericalHarmonics`` of Filament's light_indirect."""
    x, y, z = normal
    linear = c[0] + c[1] * y + c[2] * z + c[3] * x
    return np.pi * (
        linear + c[4] * y * x + c[5] * y * z + c[6] * (3 * z * z - 1) + c[7] * z * x + c[8] * (x * x - y * y)
    )


def read_three(path):
    document = json.loads(path.read_text())
    assert document["object"]["type"] == "LightProbe" and len(document["object"]["sh"]) == 27
    return np.array(document["object"]["sh"]).reshape(9, 3), np.array(document["object"]["matrix"]).reshape(4, 4).T


def read_filament(path):
    """Lines as cmgen prints them: three numbers of 18 characters, then the name of the coefficient."""
    lines = path.read_text().splitlines()
    names = [f"L{l}{m}" for l in range(3) for m in range(-l, l + 1)]
    values = []
    for line, name in zip(lines, names, strict=True):
        found = re.fullmatch(r"\((.{18}), (.{18}), (.{18})\); // (\S+), irradiance, pre-scaled base", line)
        assert found and found[4] == name
        values.append([float(found[i]) for i in (1, 2, 3)])
    return np.array(values)


@pytest.mark.parametrize("bands", [2, 4])
@pytest.mark.parametrize("placement", PLACEMENTS)
def test_both_shade_as_the_probe_itself(tmp_path, placement, bands):
    field = lit_field(*PLACEMENTS[placement], bands=bands, linear=False)
    nx, ny, nz = field.grid.resolution
    probe = tuple(min(wanted, count - 1) for wanted, count in zip(PROBE, (nx, ny, nz)))
    node = probe[0] + nx * (probe[1] + ny * probe[2])
    normals = places_inside(field.grid, 50)[1]
    expected = np.array([sh.irradiance(field.coefficients[node], normal) for normal in normals])
    for target, path in (("three-light", tmp_path / "a.json"), ("filament", tmp_path / "a.txt")):
        layout = export(field, target, path, ExportOptions(probe=probe)).conventions["layout"]
        assert layout["probe"] == list(probe)
        np.testing.assert_allclose(layout["position"], Y_UP @ field.grid.positions()[node], rtol=1e-6)
    values, matrix = read_three(tmp_path / "a.json")
    np.testing.assert_allclose(matrix[:3, 3], Y_UP @ field.grid.positions()[node], rtol=1e-6)
    found = np.array([three_irradiance(values, normal) for normal in normals @ Y_UP.T])
    np.testing.assert_allclose(found, expected, atol=expected.max() * 3e-6)  # its constants have six digits
    found = np.array([filament_irradiance(read_filament(tmp_path / "a.txt"), normal) for normal in normals @ Y_UP.T])
    np.testing.assert_allclose(found, expected, atol=expected.max() * 1e-6)


def test_filaments_first_number_is_the_mean_irradiance_over_pi(tmp_path):
    """So its documentation says; under a uniform sky of radiance L that is L."""
    field = lit_field(*PLACEMENTS["straight"])
    field.coefficients[:] = 0
    field.coefficients[:, 0] = np.array([1.0, 2.0, 3.0]) / sh.Y0
    export(field, "filament", tmp_path, ExportOptions())
    values = read_filament(tmp_path / "probes.txt")
    np.testing.assert_allclose(values[0], [1, 2, 3], rtol=1e-6)
    assert not values[1:].any()
