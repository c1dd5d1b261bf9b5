# SPDX-License-Identifier: GPL-3.0-or-later
"""What every target has in common: axes, bands, windows, fillings, precision, names of files, and the plain JSON."""

import json

import numpy as np
import pytest
from export_fields import PLACEMENTS, lit_field, places_inside
from gridlight.core import dilation, lookup, windowing
from gridlight.core import spherical_harmonics as sh
from gridlight.core.conventions import ACTIVE, CULLED, INVALID
from gridlight.core.errors import InputError
from gridlight.formats import probe_file
from gridlight.formats.export import TARGETS, ExportOptions, export
from gridlight.formats.export_lattice import axes_matrix

FIELD = lit_field(*PLACEMENTS["turned"], linear=False)


def exported_json(field, folder, **options):
    """(coefficients (P, K, 3), positions (P, 3), all of the file, result)."""
    result = export(field, "json", folder / "out.json", ExportOptions(**options))
    about = json.loads((folder / "out.json").read_text())
    positions = np.array(about["positions"]).reshape(-1, 3)
    return np.array(about["coefficients"]).reshape(len(positions), -1, 3), positions, about, result


def test_json_restores_the_field_exactly(tmp_path):
    coefficients, positions, about, _ = exported_json(FIELD, tmp_path)
    assert np.array_equal(coefficients.astype(np.float32), FIELD.coefficients)
    assert np.array_equal(positions, FIELD.grid.positions()) and about["state"] == FIELD.state.tolist()
    assert about["matrix"] == FIELD.grid.matrix.tolist() and about["coefficient_names"][1] == "L1m1"


@pytest.mark.parametrize("axes", ["blender", "y-up", "unity", "unreal", "-y,z,x", " Z, -x ,+y"])
def test_light_and_places_turn_together(tmp_path, axes):
    coefficients, positions, _, _ = exported_json(FIELD, tmp_path, axes=axes, scale=100)
    turn = axes_matrix(axes)
    np.testing.assert_allclose(positions, 100 * FIELD.grid.positions() @ turn.T, rtol=1e-12)
    normals = places_inside(FIELD.grid, len(positions))[1]
    expected = sh.irradiance(FIELD.coefficients, normals)
    np.testing.assert_allclose(sh.irradiance(coefficients, normals @ turn.T), expected, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("axes", ["", "up", "x,y", "x,y,x", "x,y,z,x", "x,,z", "1,2,3", "xx,y,z"])
def test_axes_that_make_no_sense(tmp_path, axes):
    with pytest.raises(InputError, match="--axes"):
        export(FIELD, "json", tmp_path / "o.json", ExportOptions(axes=axes))
    assert not any(tmp_path.iterdir())


def test_bands_are_cut(tmp_path):
    field = lit_field(*PLACEMENTS["straight"], bands=4, linear=False)
    for bands in (1, 2, 3, 4):
        coefficients, _, _, result = exported_json(field, tmp_path, bands=bands)
        assert np.array_equal(coefficients.astype(np.float32), field.coefficients[:, : bands * bands])
        assert (f"bands above {bands}" in result.does_not_carry) == (bands < 4)
    assert "bands above 3" in export(field, "three", tmp_path / "three", ExportOptions()).does_not_carry
    with pytest.raises(InputError, match="holds 3 at most"):
        export(field, "unity", tmp_path, ExportOptions(bands=4))
    with pytest.raises(InputError, match="the probe file holds 3"):
        export(FIELD, "json", tmp_path, ExportOptions(bands=4))


def test_windows(tmp_path):
    coefficients = exported_json(FIELD, tmp_path, window="hann:4")[0]
    np.testing.assert_allclose(coefficients, windowing.apply(FIELD.coefficients, windowing.hann(3, 4)), rtol=1e-6)
    coefficients = exported_json(FIELD, tmp_path, window="lanczos:3.5", gain=2.0)[0]
    expected = 2 * windowing.apply(FIELD.coefficients, windowing.lanczos(3, 3.5))
    np.testing.assert_allclose(coefficients, expected, rtol=1e-6)
    ringing = lit_field(*PLACEMENTS["straight"])
    ringing.coefficients[:, 0] *= 0.35
    coefficients = exported_json(ringing, tmp_path, window="auto")[0]
    directions = places_inside(ringing.grid, 500)[1]
    assert sh.irradiance(ringing.coefficients[:, None], directions).min() < -0.5
    assert sh.irradiance(coefficients[:, None], directions).min() > -1e-4


@pytest.mark.parametrize("window", ["hann", "hann:0", "hann:-1", "hann:x", "lanczos:inf", "lanczos:nan", "box:3", ""])
def test_windows_that_make_no_sense(window):
    with pytest.raises(InputError, match="--window"):
        ExportOptions(window=window)


@pytest.mark.parametrize(
    "options",
    [
        {"bands": 0},
        {"bands": 5},
        {"scale": 0.0},
        {"scale": float("nan")},
        {"gain": -1.0},
        {"gain": float("inf")},
        {"size": 0},
        {"size": 5000},
        {"refine": 0},
        {"refine": 17},
        {"precision": "double"},
        {"inactive": "drop"},
        {"layout": "ball"},
    ],
)
def test_options_out_of_range(options):
    with pytest.raises(InputError, match=f"--{next(iter(options))}"):
        ExportOptions(**options)


def test_probes_without_light_are_filled_or_marked(tmp_path):
    """A file whose culled and invalid probes are black, as other programs may write one."""
    field = lit_field(*PLACEMENTS["straight"], linear=False)
    field.state[[7, 23]] = INVALID
    black = field.state != ACTIVE
    baked = exported_json(field, tmp_path)[0]
    assert np.array_equal(baked.astype(np.float32), field.coefficients), "light that is stored already is kept"
    zero = exported_json(field, tmp_path, inactive="zero")[0]
    assert not zero[black].any() and np.array_equal(zero[~black].astype(np.float32), field.coefficients[~black])
    field.coefficients[black] = 0
    filled, _, about, result = exported_json(field, tmp_path)
    expected = dilation.fill(field.grid, field.coefficients, ~black)
    np.testing.assert_allclose(filled, expected, rtol=1e-6)
    assert about["state"][7] == INVALID and CULLED in about["state"]
    counts = result.conventions["probes"]
    assert counts["invalid"] == 2 and "filled on export" in counts["culled_and_invalid_hold"]


def test_half_floats_are_exact_as_text_and_cut_with_a_warning(tmp_path):
    coefficients = exported_json(FIELD, tmp_path, precision="half")[0]
    assert np.array_equal(coefficients.astype(np.float16), FIELD.coefficients.astype(np.float16))
    field = lit_field(*PLACEMENTS["straight"])
    result = export(field, "three", tmp_path / "three", ExportOptions(gain=1e4))
    assert any("beyond the range of half floats" in warning for warning in result.warnings)
    assert np.isfinite(np.fromfile(tmp_path / "three" / "probes.bin", "<f2")).all()
    assert any("dim" in w for w in export(field, "three", tmp_path / "three", ExportOptions(gain=1e-5)).warnings)
    assert not export(field, "three", tmp_path / "three", ExportOptions(gain=1e-5, precision="float")).warnings


@pytest.mark.parametrize("target", TARGETS)
def test_the_same_light_in_every_target_from_far_away(tmp_path, target):
    """100 km from the origin, and a file of conventions beside every format."""
    matrix = PLACEMENTS["straight"][0].copy()
    matrix[:3, 3] += 1e5
    field = lit_field(matrix, (3, 4, 5))
    result = export(field, target, tmp_path / "out", ExportOptions(), "somewhere/probes.exr")
    conventions = json.loads((tmp_path / "out" / result.files[-1].split("/")[-1]).read_text())
    assert result.files[-1].endswith(".conventions.json") and conventions["format"] == target
    assert conventions["source"]["file"] == "probes.exr" and conventions["does_not_carry"]
    assert {"space", "light", "layout", "engine", "run_in_engine"} <= set(conventions)


def test_files_take_the_name_asked_for(tmp_path):
    export(FIELD, "godot", tmp_path / "a" / "hall.tres", ExportOptions())
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["hall.conventions.json", "hall.tres"]
    export(FIELD, "bevy", tmp_path / "b", ExportOptions())
    assert (tmp_path / "b" / "probes.ktx2").is_file()
    for target, name, words in (("godot", "x.ktx2", "a .tres file"), ("three", "x.html", "writes a folder")):
        with pytest.raises(InputError, match=words):
            export(FIELD, target, tmp_path / name, ExportOptions())
    with pytest.raises(InputError, match="choose one of three, godot"):
        export(FIELD, "quake", tmp_path, ExportOptions())


def test_a_probe_file_is_never_replaced_by_its_own_export(tmp_path):
    source = tmp_path / "probes.exr"
    probe_file.write(source, FIELD)
    before = source.read_bytes()
    export(FIELD, "exr-flipbook", tmp_path, ExportOptions(), source)
    with pytest.raises(InputError, match="is the probe file itself"):
        export(FIELD, "exr-flipbook", source, ExportOptions(), source)
    assert source.read_bytes() == before
    assert not list(tmp_path.glob(".*"))


def test_a_failure_leaves_nothing(tmp_path, monkeypatch):
    def fail(job):
        job.path(".half").write_text("half a file")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(TARGETS["godot"], "write", fail)
    with pytest.raises(InputError, match="No space left"):
        export(FIELD, "godot", tmp_path / "new" / "light.tres", ExportOptions())
    assert not any(tmp_path.iterdir())


def test_eval_and_the_exports_share_one_space():
    """The fields of these tests hide nothing, so that ``eval`` is trilinear: the ground all comparisons stand on."""
    points, normals = places_inside(FIELD.grid, 50)
    nodes, weights = lookup.trilinear(FIELD.grid, points)
    plain = sh.irradiance(np.einsum("nw,nwkc->nkc", weights, FIELD.coefficients[nodes].astype(float)), normals)
    np.testing.assert_allclose(lookup.irradiance(FIELD, points, normals), plain, rtol=1e-6)
