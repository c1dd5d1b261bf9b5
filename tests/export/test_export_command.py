# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight export`` as a process: what it prints, how it ends, how long it takes."""

import json
import subprocess
import sys
import time

import numpy as np
import pytest
from export_fields import PLACEMENTS, lit_field
from gridlight.core.conventions import CULLED
from gridlight.core.grid import Grid
from gridlight.formats import probe_file
from gridlight.formats.export import TARGETS, ExportOptions, export
from gridlight.tests.command_line import assert_one_line, last_json


@pytest.fixture(scope="module")
def probes(tmp_path_factory):
    path = tmp_path_factory.mktemp("probes") / "probes.exr"
    probe_file.write(path, lit_field(*PLACEMENTS["straight"], linear=False))
    return path


def test_a_run_names_its_files_and_losses(run_gridlight, probes, tmp_path):
    done = run_gridlight("export", probes, "--to", "bevy", "-o", tmp_path / "hall.ktx2", "--bands", 2)
    assert done.returncode == 0, done.stderr
    summary = last_json(done)
    assert summary["files"] == [str(tmp_path / "hall.ktx2"), str(tmp_path / "hall.conventions.json")]
    assert summary["warnings"] == [] and any("visibility" in loss for loss in summary["does_not_carry"])
    assert "bevy does not carry visibility weights" in done.stderr and "bands above 2" in done.stderr


def test_quiet_and_axes_that_start_with_a_minus(run_gridlight, probes, tmp_path):
    done = run_gridlight("export", probes, "--to", "json", "-o", tmp_path, "--axes", "-x,z,-y", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    about = json.loads((tmp_path / "probes.conventions.json").read_text())
    assert about["space"]["x_y_z_are_blenders"] == ["-x", "+z", "-y"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--to", "quake", "-o", "{out}"], ["choose one of three"]),
        (["--to", "godot", "-o", "{out}.png"], ["a .tres file or a folder"]),
        (["--to", "json", "-o", "{out}", "--bands", "4"], ["holds 3"]),
        (["--to", "json", "-o", "{out}", "--bands", "-1"], ["--bands is -1"]),
        (["--to", "json", "-o", "{out}", "--gain", "-2"], ["--gain is -2"]),
        (["--to", "json", "-o", "{out}", "--scale", "0"], ["--scale is 0"]),
        (["--to", "json", "-o", "{out}", "--axes", "sideways"], ["--axes sideways"]),
        (["--to", "json", "-o", "{out}", "--window", "triangle"], ["--window triangle"]),
        (["--to", "json", "-o", "{out}", "--precision", "double"], ["half or float"]),
        (["--to", "cubemap", "-o", "{out}", "--probe", "9,9,9"], ["counted from 0"]),
        (["--to", "cubemap", "-o", "{out}", "--probe", "1,1"], ["not three whole numbers"]),
        (["--to", "godot", "-o", "{out}", "--scene", "x.blend"], ["--to three"]),
        (["--to", "three", "-o", "{out}", "--scene", "x.blend", "--scale", "100"], ["in metres"]),
        (["--to", "three", "-o", "/proc/here"], ["/proc/here"]),
        (["--to", "json"], ["-o"]),
        (["-o", "{out}"], ["--to"]),
    ],
)
def test_what_is_wrong_is_one_line(run_gridlight, probes, tmp_path, options, words):
    options = [option.format(out=tmp_path / "out") for option in options]
    assert_one_line(run_gridlight("export", probes, *options), 2, *words)
    assert not any(tmp_path.iterdir())


def test_a_damaged_probe_file_is_one_line(run_gridlight, probes, tmp_path):
    cut = tmp_path / "cut.exr"
    cut.write_bytes(probes.read_bytes()[:-100])
    assert_one_line(run_gridlight("export", cut, "--to", "json", "-o", tmp_path / "out"), 2, "cut.exr", "damaged")


def test_export_loads_no_blender(probes, tmp_path, root):
    program = (
        "import runpy, sys\nsys.argv = ['gridlight', 'export', sys.argv[1], '--to', 'three', '-o', sys.argv[2]]\n"
        f"try: runpy.run_path({str(root / 'cli' / '__main__.py')!r}, run_name='__main__')\n"
        "except SystemExit as end: print(end.code, sorted({'bpy', 'gpu', 'mathutils'} & set(sys.modules)))\n"
    )
    command = [sys.executable, "-I", "-c", program, str(probes), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert done.stdout.splitlines()[-1] == "0 []", done.stderr


@pytest.fixture(scope="module")
def large_files(tmp_path_factory):
    """32³ probes in a straight and in a turned volume, a third of them without light."""
    folder = tmp_path_factory.mktemp("large")
    field = lit_field(PLACEMENTS["straight"][0], (32, 32, 32), linear=False)
    field.state[np.random.default_rng(0).random(len(field.state)) < 0.3] = CULLED
    field.coefficients[field.state == CULLED] = 0
    for placement in ("straight", "turned"):
        field.grid = Grid(PLACEMENTS[placement][0], (32, 32, 32))
        probe_file.write(folder / f"{placement}.exr", field)
    return folder


@pytest.mark.parametrize("target", TARGETS)
def test_32_cubed_probes_take_under_two_seconds(large_files, tmp_path, target):
    """Processor time from reading to the last file, with probes to be filled."""
    for placement in ("straight", "turned"):
        started = time.process_time()
        export(probe_file.read(large_files / f"{placement}.exr"), target, tmp_path / placement, ExportOptions())
        assert time.process_time() - started < 2
