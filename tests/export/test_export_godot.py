# SPDX-License-Identifier: GPL-3.0-or-later
"""Godot: the resource read by an independent parser, and walked and shaded as the engine does it, against ``eval``.

The walk is ``LightStorage::lightmap_tap_sh_light``, the shading the capture part of ``scene_forward_clustered.glsl``
(4.x). Godot interpolates in tetrahedra, so between probes only light that changes linearly must agree.
"""

import numpy as np
import pytest
from export_fields import PLACEMENTS, Y_UP, box, lit_field, places_inside
from godot_parser import GDFile, load
from gridlight.core import lookup
from gridlight.core.errors import InputError
from gridlight.core.grid import Grid
from gridlight.formats import export_godot
from gridlight.formats.export import ExportOptions, export


def numbers(file: GDFile, name: str, dtype) -> np.ndarray:
    """The numbers of ``name`` in probe_data; the parser gives GDObjects of Python numbers."""
    value = file.find_section("resource")["probe_data"][name]
    return np.array(value.args, dtype)


class GodotProbes:
    def __init__(self, path):
        file = load(str(path))
        assert file.find_section("gd_resource").header.attributes["type"] == "LightmapGIData"
        data = file.find_section("resource")["probe_data"]
        assert set(data) == {"baked_exposure", "bounds", "bsp", "interior", "points", "sh", "tetrahedra"}
        assert data["baked_exposure"] == 1.0 and data["interior"] is False
        types = {"bounds": "AABB", "points": "PackedVector3Array", "sh": "PackedColorArray"}
        types |= {"bsp": "PackedInt32Array", "tetrahedra": "PackedInt32Array"}
        assert {name: data[name].name for name in types} == types
        self.points = numbers(file, "points", np.float32).reshape(-1, 3).astype(float)
        self.sh = numbers(file, "sh", np.float32).reshape(-1, 9, 4).astype(float)
        self.tetrahedra = numbers(file, "tetrahedra", np.int32).reshape(-1, 4)
        words = numbers(file, "bsp", np.int32).reshape(-1, 6)
        self.planes = np.ascontiguousarray(words[:, :4]).view(np.float32).astype(float)
        self.children = words[:, 4:]
        self.bounds = numbers(file, "bounds", float).reshape(2, 3)

    def find(self, point) -> int:
        node = 0
        while node >= 0:
            plane = self.planes[node]
            child = self.children[node][0 if plane[:3] @ point > plane[3] else 1]
            assert child < 0 or child > node, "Godot refuses trees whose children come first"
            node = child
        assert node != -(2**31), "an empty leaf inside the grid"
        return -node - 1

    def barycentric(self, point) -> tuple[np.ndarray, np.ndarray]:
        corners = self.tetrahedra[self.find(point)]
        places = self.points[corners]
        rest = np.linalg.solve((places[1:] - places[0]).T, point - places[0])
        return corners, np.array([1 - rest.sum(), *rest])

    def irradiance(self, points, normals):
        """π times the ambient light of a white surface, for an object at each of ``points``."""
        result = []
        for point, (x, y, z) in zip(points, normals):
            corners, weights = self.barycentric(point)
            sh = np.einsum("w,wkc->kc", np.clip(weights, 0, 1), self.sh[corners])[:, :3]
            c = (0.886227, 1.023327, 0.858086, 0.247708, 0.429043)
            light = c[0] * sh[0] + c[1] * (sh[1] * y + sh[2] * z + sh[3] * x)
            light = light + c[2] * (sh[4] * x * y + sh[5] * y * z + sh[7] * x * z)
            light = light + c[3] * sh[6] * (3 * z * z - 1) + c[4] * sh[8] * (x * x - y * y)
            result.append(np.pi * light)
        return np.array(result)


def exported(field, folder, **options):
    export(field, "godot", folder / "light.tres", ExportOptions(**options))
    return GodotProbes(folder / "light.tres")


@pytest.mark.parametrize("placement", PLACEMENTS)
def test_agrees_with_eval_everywhere_on_a_linear_field(tmp_path, placement):
    field = lit_field(*PLACEMENTS[placement], linear=True)
    probes = exported(field, tmp_path)
    points, normals = places_inside(field.grid, 300)
    found = probes.irradiance(points @ Y_UP.T, normals @ Y_UP.T)
    np.testing.assert_allclose(found, lookup.irradiance(field, points, normals), rtol=1e-5)


@pytest.mark.parametrize("precision", ["half", "float"])
def test_agrees_with_eval_at_every_probe_of_any_field(tmp_path, precision):
    field = lit_field(*PLACEMENTS["turned"], linear=False)
    probes = exported(field, tmp_path, precision=precision)
    normals = places_inside(field.grid, field.grid.count)[1]
    points = field.grid.positions()
    expected = lookup.irradiance(field, points, normals)
    tolerance = expected.max() * (2.0**-10 if precision == "half" else 1e-5)
    found = probes.irradiance(points @ Y_UP.T, normals @ Y_UP.T)
    np.testing.assert_allclose(found, expected, atol=tolerance)


@pytest.mark.parametrize("resolution", [(2, 2, 2), (3, 2, 5), (4, 4, 3), (1, 3, 2), (2, 1, 1)])
def test_the_walk_finds_the_tetrahedron_that_holds_the_point(tmp_path, resolution):
    field = lit_field(box((4, 6, 3), turn=PLACEMENTS["turned"][0][:3, :3] * 0.3), resolution, linear=False)
    probes = exported(field, tmp_path)
    seen = set()
    for point in places_inside(field.grid, 500)[0] @ Y_UP.T:
        seen.add(probes.find(point))
        assert probes.barycentric(point)[1].min() > -1e-4
    cells = np.prod(np.maximum(np.array(resolution), 2) - 1)
    assert len(probes.tetrahedra) == 6 * cells and len(seen) > 4 * cells
    volumes = np.linalg.det(np.diff(probes.points[probes.tetrahedra], axis=1))
    size = abs(np.linalg.det(2 * field.grid.matrix[:3, :3]))
    assert np.abs(volumes).sum() / 6 == pytest.approx(size, rel=1e-4), "tetrahedra fill the box once"


def test_bounds_hold_all_points(tmp_path):
    field = lit_field(*PLACEMENTS["turned"])
    probes = exported(field, tmp_path)
    np.testing.assert_allclose(probes.bounds[0], probes.points.min(axis=0), rtol=1e-6)
    np.testing.assert_allclose(probes.bounds.sum(axis=0), probes.points.max(axis=0), rtol=1e-6)


def test_too_many_probes_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(export_godot, "MOST_PROBES", 10)
    with pytest.raises(InputError, match="too many for Godot"):
        export(lit_field(*PLACEMENTS["straight"]), "godot", tmp_path / "light.tres", ExportOptions())
    assert not any(tmp_path.iterdir())


def test_the_tree_of_a_large_grid_is_balanced():
    from gridlight.formats.export_lattice import Lattice

    grid = Grid.from_bounds((0, 0, 0), (1, 1, 1), (9, 33, 17))
    tree = export_godot.plane_tree(Lattice(grid, None, None))
    cells = 8 * 32 * 16
    assert len(tree) == (cells - 1) + 5 * cells
    leaves = tree[:, 4:][tree[:, 4:] < 0]
    assert sorted(-1 - leaves) == list(range(6 * cells)), "every tetrahedron is one leaf"
    depth = np.zeros(len(tree), int)
    for node, children in enumerate(tree[:, 4:]):
        depth[children[children > 0]] = depth[node] + 1
    assert depth.max() <= np.log2(cells) + 3
