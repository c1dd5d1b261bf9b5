# SPDX-License-Identifier: GPL-3.0-or-later
"""three.js: the atlas, sampled as its shader lightprobes_pars_fragment (r187) samples it, against ``eval``.

The shader looks half a cell along the normal; there ``eval`` must agree, and in an open field it does to the half
floats' accuracy. tests/web runs the same in the real engine.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from export_fields import PLACEMENTS, STRAIGHT, Y_UP, lit_field, places_inside, sample_volume
from gridlight.core import lookup
from gridlight.core.windowing import apply
from gridlight.formats.export import ExportOptions, export, window_factors

HALF = 2.0**-10


class ThreeProbes:
    """The exported files, as three.js sees them."""

    def __init__(self, folder):
        self.about = json.loads((folder / "probes.json").read_text())
        kind = {"half": "<f2", "float": "<f4"}[self.about["type"]]
        width, height, depth = self.about["atlas_size"]
        raw = np.fromfile(folder / self.about["atlas"], kind)
        self.texture = raw.reshape(depth, height, width, 4).astype(float)
        self.resolution = np.array(self.about["resolution"])
        center, size = np.array(self.about["center"]), np.array(self.about["size"])
        self.low, self.high = center - size / 2, center + size / 2
        self.spacing = size / self.resolution

    def irradiance(self, points, normals):
        """Line by line as the shader has it; points and normals in three.js's space."""
        place = points + normals * self.spacing * 0.5
        inside = ((place >= self.low - 0.01 * self.spacing) & (place <= self.high + 0.01 * self.spacing)).all(axis=1)
        half_texel = 0.5 / self.resolution
        uvw = np.clip((place - self.low) / (self.high - self.low), half_texel, 1 - half_texel)
        slices = self.resolution[2] + 2
        numbers = []
        for block in range(7):
            w = (uvw[:, 2] * self.resolution[2] + 1 + block * slices) / (7 * slices)
            numbers.append(sample_volume(self.texture, np.column_stack([uvw[:, :2], w])))
        c = np.concatenate(numbers, axis=1)[:, :27].reshape(-1, 9, 3).transpose(1, 0, 2)
        x, y, z = (normals[:, axis, None] for axis in range(3))
        result = c[0] * 0.886227
        result = result + c[1] * 2 * 0.511664 * y + c[2] * 2 * 0.511664 * z + c[3] * 2 * 0.511664 * x
        result = result + c[4] * 2 * 0.429043 * x * y + c[5] * 2 * 0.429043 * y * z
        result = result + c[6] * (0.743125 * z * z - 0.247708)
        result = result + c[7] * 2 * 0.429043 * x * z + c[8] * 0.429043 * (x * x - y * y)
        return np.where(inside[:, None], np.maximum(result, 0), 0)


def exported(field, folder, **options):
    return export(field, "three", folder, ExportOptions(**options)), ThreeProbes(folder)


@pytest.mark.parametrize("precision", ["half", "float"])
@pytest.mark.parametrize("linear", [True, False], ids=["linear", "random"])
@pytest.mark.parametrize("placement", STRAIGHT)
def test_agrees_with_eval_where_its_shader_looks(tmp_path, placement, linear, precision):
    field = lit_field(*PLACEMENTS[placement], linear=linear)
    result, probes = exported(field, tmp_path, precision=precision)
    assert result.conventions["resampled"] is None and not result.warnings
    points, normals = places_inside(field.grid, 500)
    looked_at = points + normals @ Y_UP.T * probes.spacing * 0.5 @ Y_UP
    expected = lookup.irradiance(field, looked_at, normals)
    found = probes.irradiance(points @ Y_UP.T, normals @ Y_UP.T)
    lattice = looked_at @ field.grid.world_to_lattice()[:, :3].T + field.grid.world_to_lattice()[:, 3]
    on_border = (np.abs(lattice - np.round(lattice)) < lookup.ON_BORDER).any(axis=1)  # eval takes the border's corners
    inside = (found != 0).any(axis=1) & ~on_border
    assert inside.sum() > 300
    tolerance = expected.max() * (HALF if precision == "half" else 3e-6)
    np.testing.assert_allclose(found[inside], expected[inside], atol=tolerance)


@pytest.mark.parametrize("placement", sorted(set(PLACEMENTS) - set(STRAIGHT)))
def test_a_turned_volume_is_laid_straight(tmp_path, placement):
    """Away from the faces, where the straight box has no nodes outside the old one, a linear field stays exact."""
    field = lit_field(*PLACEMENTS[placement], linear=True)
    result, probes = exported(field, tmp_path, precision="float")
    assert result.conventions["resampled"]["resolution"] == probes.about["resolution"]
    assert any("rotated" in warning for warning in result.warnings)
    points, normals = places_inside(field.grid, 4000)
    looked_at = points + normals @ Y_UP.T * probes.spacing * 0.5 @ Y_UP
    # Of the cell around the place that the shader looks at, all corners must lie in the old box.
    cell = np.floor((looked_at @ Y_UP.T - probes.low) / probes.spacing - 0.5)
    corners = np.array(list(np.ndindex(2, 2, 2)))
    nodes = (cell[:, None] + corners + 0.5) * probes.spacing + probes.low
    local = (nodes @ Y_UP - field.grid.center) @ np.linalg.inv(field.grid.matrix[:3, :3]).T
    deep = (np.abs(local) <= 1).all(axis=(1, 2))
    assert deep.sum() >= 20
    expected = lookup.irradiance(field, looked_at[deep], normals[deep])
    found = probes.irradiance(points[deep] @ Y_UP.T, normals[deep] @ Y_UP.T)
    np.testing.assert_allclose(found, expected, rtol=1e-5)


def test_the_stated_cost_of_laying_straight_is_true(tmp_path):
    field = lit_field(*PLACEMENTS["turned"], linear=False)
    result, probes = exported(field, tmp_path, precision="float")
    points, normals = places_inside(field.grid, 3000)
    shifted = points + normals @ Y_UP.T * probes.spacing * 0.5 @ Y_UP
    inside = (np.abs((shifted - field.grid.center) @ np.linalg.inv(field.grid.matrix[:3, :3]).T) <= 1).all(axis=1)
    expected = lookup.irradiance(field, shifted[inside], normals[inside])
    found = probes.irradiance(points[inside] @ Y_UP.T, normals[inside] @ Y_UP.T)
    measured = np.sqrt(np.mean((found - expected) ** 2) / np.mean(expected**2))
    stated = result.conventions["resampled"]["relative_rms_between_probes"]
    assert 0.5 < measured / stated < 1.5, (measured, stated)


@pytest.mark.parametrize("refine", [2, 3, 8])
@pytest.mark.parametrize("placement", STRAIGHT)
def test_refined_it_looks_closer_to_the_surface(tmp_path, placement, refine):
    """The same trilinear light, and as far beyond the outermost probes, from a shorter way along the normal."""
    matrix, resolution = PLACEMENTS[placement]
    field = lit_field(matrix, (*resolution[:2], 1) if refine == 3 else resolution, linear=False)
    _result, coarse = exported(field, tmp_path / "coarse", precision="float")
    result, probes = exported(field, tmp_path / "fine", precision="float", refine=refine)
    assert result.conventions["resampled"] is None
    many = coarse.resolution > 1
    np.testing.assert_allclose(probes.spacing[many], coarse.spacing[many] / refine)
    assert (probes.low <= coarse.low + 1e-9).all() and (probes.high >= coarse.high - 1e-9).all()
    assert (probes.high - coarse.high < coarse.spacing / refine).all()
    points, normals = places_inside(field.grid, 300, share=0.8)
    looked_at = points + normals @ Y_UP.T * probes.spacing * 0.5 @ Y_UP
    expected = lookup.irradiance(field, looked_at, normals)
    found = probes.irradiance(points @ Y_UP.T, normals @ Y_UP.T)
    inside = (found != 0).any(axis=1)
    np.testing.assert_allclose(found[inside], expected[inside], rtol=1e-5)
    assert inside.sum() > 200 or refine == 3


@pytest.mark.parametrize("placement", PLACEMENTS)
@pytest.mark.parametrize("window", ["none", "hann:4"])
def test_refined_it_follows_gradients(tmp_path, placement, window):
    """Cells of an eighth hold what eval finds between probes, and up to half a cell past them."""
    field = lit_field(*PLACEMENTS[placement], linear=False)
    field.gradient[:] = np.random.default_rng(6).normal(0, 1.0, field.gradient.shape)
    plain = replace(field, gradient=None)
    _result, probes = exported(field, tmp_path, precision="float", refine=8, window=window)
    factors = window_factors(window, 3)
    field.coefficients = apply(field.coefficients, factors).astype(np.float32)
    field.gradient = apply(field.gradient.reshape(-1, 9, 3), factors).reshape(field.gradient.shape)
    points, normals = places_inside(field.grid, 400, share=1.05)
    looked_at = points + normals @ Y_UP.T * probes.spacing * 0.5 @ Y_UP
    expected = lookup.irradiance(field, looked_at, normals)
    found = probes.irradiance(points @ Y_UP.T, normals @ Y_UP.T)
    within = (found != 0).any(axis=1)
    plain.coefficients = field.coefficients
    without = lookup.irradiance(plain, looked_at, normals)
    assert within.sum() > 300
    error, missing = (np.sqrt(np.mean((values - expected)[within] ** 2)) for values in (found, without))
    assert error < (0.1 if placement in STRAIGHT else 0.25) * missing


def test_bright_sides_are_where_blender_has_them(tmp_path):
    field = lit_field(*PLACEMENTS["straight"])
    _result, probes = exported(field, tmp_path)
    center = (field.grid.center @ Y_UP.T)[None].repeat(6, axis=0)
    normals = np.concatenate([np.eye(3), -np.eye(3)])
    red, green, blue = probes.irradiance(center, normals).T
    assert red.argmax() == 0, "red comes from +X, which is +X"
    assert green.argmax() == 5, "green comes from +Y, which is -Z"
    assert blue.argmax() == 1, "blue comes from above, which is +Y"


def test_box_is_stated_for_old_and_new_releases(tmp_path):
    field = lit_field(*PLACEMENTS["straight"])
    _result, probes = exported(field, tmp_path)
    np.testing.assert_allclose(probes.about["probe_extent"], [4, 3, 6])
    np.testing.assert_allclose(probes.about["size"], [4 * 3 / 2, 3 * 4 / 3, 6 * 5 / 4])
    np.testing.assert_allclose(probes.about["center"], [1, 3, 2])


def test_padding_slices_repeat_their_neighbours(tmp_path):
    _result, probes = exported(lit_field(*PLACEMENTS["straight"], linear=False), tmp_path)
    slices = probes.texture.reshape(7, probes.resolution[2] + 2, *probes.texture.shape[1:])
    assert np.array_equal(slices[:, 0], slices[:, 1]) and np.array_equal(slices[:, -1], slices[:, -2])
    assert not np.array_equal(slices[:, 1], slices[:, 2])


def test_a_single_layer_of_probes(tmp_path):
    field = lit_field(PLACEMENTS["straight"][0], (3, 1, 4), linear=False)
    _result, probes = exported(field, tmp_path)
    points, normals = places_inside(field.grid, 200)
    normals[:] = [[1, 0, 0]]
    looked_at = points + [[probes.spacing[0] / 2, 0, 0]]
    expected = lookup.irradiance(field, looked_at, normals)
    found = probes.irradiance(points @ Y_UP.T, normals @ Y_UP.T)
    np.testing.assert_allclose(found, expected, atol=expected.max() * HALF)
