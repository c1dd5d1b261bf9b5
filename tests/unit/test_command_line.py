# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line without Blender: arguments, exit statuses, one-line errors, eval, info, diff, broken pipes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from gridlight.cli import arguments
from gridlight.cli.main import Stop
from gridlight.core.conventions import CULLED
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.formats import probe_file
from gridlight.tests.command_line import assert_one_line, last_json, run_on_a_full_disk

Y00 = 0.28209479177387814


@pytest.fixture
def constant_file(tmp_path):
    """A probe file whose radiance is (1, 2, 3) everywhere: irradiance is π times that for every normal."""
    field = Field.empty(Grid.from_bounds((-1, -1, -1), (1, 2, 3), (3, 4, 5), "Room"), 3)
    field.coefficients[:, 0] = np.array([1, 2, 3]) / Y00
    field.depth[..., 0], field.depth[..., 1] = 1, 1
    field.metadata = {"device": "none", "warnings": ["first"], "settings": {"face": 16}}
    path = tmp_path / "probes.exr"
    probe_file.write(path, field)
    return path


# Arguments
# ----------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "read"),
    [
        (["--min", "-1,-2,0", "--max", "1,1,1"], ["--min=-1,-2,0", "--max", "1,1,1"]),
        (["--min", "-.5,0,0"], ["--min=-.5,0,0"]),
        (["--min", "-1e-3,0,0"], ["--min=-1e-3,0,0"]),
        (["--min"], ["--min"]),
        (["--min", "--max", "1,1,1"], ["--min", "--max", "1,1,1"]),
        (["--min", "-o"], ["--min", "-o"]),
        (["--", "--min", "-1,0,0"], ["--", "--min", "-1,0,0"]),
        (["--frame", "-3"], ["--frame=-3"]),
        (["--relight", "-3", "--quiet", "-o", "out"], ["--relight=-3", "--quiet", "-o", "out"]),
        (["--axes", "-x,z,y"], ["--axes=-x,z,y"]),
        (["--frames", "-5--3"], ["--frames=-5--3"]),
    ],
)
def test_values_with_a_minus_sign(given, read):
    assert arguments.join_signed_values(given) == read


@pytest.mark.parametrize("text", ["1,2", "1,2,3,4", "a,b,c", "nan,0,0", "0,inf,0", ""])
def test_points_that_are_none(text):
    with pytest.raises(Exception, match="three finite numbers"):
        arguments.point(text)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "x"])
def test_lengths_that_are_none(text):
    with pytest.raises(Exception, match="greater than 0"):
        arguments.length(text)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], ["bake", "eval"]),
        (["nonsense"], ["nonsense"]),
        (["bake"], ["FILE.blend"]),
        (["bake", "x.blend"], ["-o"]),
        (["bake", "x.blend", "-o", "out"], ["x.blend", "no such file"]),
        (["bake", "x.blend", "-o", "out", "--bands", "5"], ["--bands is 5", "1 and 4"]),
        (["bake", "x.blend", "-o", "out", "--bands", "three"], ["--bands", "'three' is not a whole number"]),
        (["bake", "x.blend", "-o", "out", "--tolerance", "little"], ["--tolerance", "'little' is not a number"]),
        (["bake", "x.blend", "-o", "out", "--face", "1000"], ["--face is 1000"]),
        (["bake", "x.blend", "-o", "out", "--bounces", "-1"], ["--bounces is -1"]),
        (["bake", "x.blend", "-o", "out", "--bounces", "many"], ["--bounces", "many"]),
        (["bake", "x.blend", "-o", "out", "--tolerance", "nan"], ["--tolerance is nan"]),
        (["bake", "x.blend", "-o", "out", "--memory", "0"], ["--memory is 0"]),
        (["bake", "x.blend", "-o", "out", "--capture", "magic"], ["--capture", "magic"]),
        (["bake", "x.blend", "-o", "out", "--min", "0,0,0"], ["--min and --max"]),
        (["bake", "x.blend", "-o", "out", "--min", "0,0,0", "--max", "1,1,1"], ["--resolution"]),
        (
            ["bake", "x.blend", "-o", "out", "--min", "0,0,0", "--max", "1,1,1", "--resolution", "2,2"],
            ["--resolution", "2,2"],
        ),
        (["bake", "x.blend", "-o", "out", "--resolution", "2,2,2", "--spacing", "1"], ["exclude each other"]),
        (["bake", "x.blend", "-o", "out", "--spacing", "-1"], ["--spacing", "-1"]),
        (["bake", "x.blend", "-o", "out", "--nonsense"], ["--nonsense"]),
        (["bake", "x.blend", "-o", "out", "--band", "3"], ["--band"]),
        (["info"], ["PROBES.exr"]),
        (["info", "nope.exr"], ["nope.exr", "No such file"]),
    ],
)
def test_wrong_options_end_in_one_line(run_gridlight, tmp_path, options, words):
    assert_one_line(run_gridlight(*options, cwd=tmp_path), 2, *words)
    assert not list(tmp_path.iterdir())


def test_version_is_the_manifests(run_gridlight, root):
    done = run_gridlight("--version")
    assert done.returncode == 0 and done.stdout.startswith("Gridlight ")
    assert f'version = "{done.stdout.split()[1]}"' in (root / "blender_manifest.toml").read_text()


def test_help_names_the_commands(run_gridlight):
    done = run_gridlight("--help")
    assert done.returncode == 0
    for command in ("bake", "eval", "info", "diff"):
        assert command in done.stdout


# Info and diff
# ----------------------------------------------------------------------------------------------------------------------


def test_info_says_what_the_file_holds(run_gridlight, constant_file):
    done = run_gridlight("info", constant_file)
    assert done.returncode == 0 and done.stderr == ""
    summary = last_json(done)
    assert summary["probes"] == {"total": 60, "active": 60, "culled": 0, "invalid": 0}
    assert summary["resolution"] == [3, 4, 5] and summary["bands"] == 3 and summary["warnings"] == ["first"]
    assert summary["bounds"] == {"min": [-1, -1, -1], "max": [1, 2, 3]}
    assert summary["mean_radiance"]["mean"] == pytest.approx(0.2126 + 2 * 0.7152 + 3 * 0.0722)
    assert "Room" in done.stdout and "3 × 4 × 5 = 60" in done.stdout


def test_a_full_disk_behind_standard_output_is_one_line(run_gridlight, constant_file):
    with open("/dev/full", "w") as full:
        done = run_gridlight("info", constant_file, stdout=full, stderr=subprocess.PIPE, capture_output=False)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1 and "standard output" in done.stderr


def test_info_is_quick_and_loads_no_blender(constant_file, root):
    program = (
        "import runpy, sys\nsys.argv = ['gridlight', 'info', sys.argv[1]]\n"
        f"try: runpy.run_path({str(root / 'cli' / '__main__.py')!r}, run_name='__main__')\n"
        "except SystemExit as end: print(end.code, sorted({'bpy', 'gpu', 'mathutils'} & set(sys.modules)))\n"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", program, str(constant_file)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.stdout.splitlines()[-1] == "0 []", done.stderr


def test_diff_finds_the_probe_that_changed(run_gridlight, constant_file, tmp_path):
    field = probe_file.read(constant_file)
    field.coefficients[17, 0] *= 1.5
    field.state[3] = CULLED
    other = tmp_path / "other.exr"
    probe_file.write(other, field)
    same, changed = (
        last_json(run_gridlight("diff", constant_file, constant_file)),
        run_gridlight("diff", constant_file, other),
    )
    assert same["identical"] and same["rms"] == 0
    assert changed.returncode == 0
    summary = last_json(changed)
    assert not summary["identical"] and summary["compared"] == 59 and summary["states_differ"] == 1
    assert summary["worst"]["node"] == [2, 1, 1]
    expected = np.sqrt(np.sum((0.5 * np.array([1, 2, 3]) / Y00) ** 2) / (59 * 3))
    assert summary["bands"][0]["rms"] == pytest.approx(expected, rel=1e-5)
    assert summary["bands"][1] == {"band": 1, "rms": 0.0, "relative": None}


@pytest.mark.parametrize("what", ["validity", "offset", "depth"])
def test_files_that_differ_in_what_a_lookup_reads_are_not_identical(run_gridlight, constant_file, tmp_path, what):
    """It was said of files with other offsets and depths, which light surfaces differently."""
    field = probe_file.read(constant_file)
    getattr(field, what).flat[5] += 0.25
    other = tmp_path / "other.exr"
    probe_file.write(other, field)
    summary = last_json(run_gridlight("diff", constant_file, other))
    assert not summary["identical"] and summary["rms"] == 0


def test_diff_of_different_grids_is_refused(run_gridlight, constant_file, tmp_path):
    other = tmp_path / "other.exr"
    probe_file.write(other, Field.empty(Grid.from_bounds((0, 0, 0), (1, 1, 1), (3, 4, 5)), 3))
    assert_one_line(run_gridlight("diff", constant_file, other), 2, "different places")
    probe_file.write(other, Field.empty(Grid.from_bounds((0, 0, 0), (1, 1, 1), (2, 2, 2)), 3))
    assert_one_line(run_gridlight("diff", constant_file, other), 2, "different grids")


# Eval
# ----------------------------------------------------------------------------------------------------------------------


def test_eval_of_constant_radiance_is_pi_times_it(run_gridlight, constant_file, tmp_path):
    rng = np.random.default_rng(3)
    table = np.concatenate([rng.uniform(-1, 1, (500, 3)), rng.normal(size=(500, 3))], axis=1)
    points, result = tmp_path / "p.csv", tmp_path / "e.csv"
    np.savetxt(points, table, delimiter=",", header="x,y,z,nx,ny,nz", comments="", fmt="%.17g")
    done = run_gridlight("eval", constant_file, "--points", points, "-o", result, "--quiet")
    assert (done.returncode, done.stderr) == (0, "")
    assert last_json(done)["points"] == 500
    assert result.read_text().splitlines()[0] == "x,y,z,nx,ny,nz,Er,Eg,Eb"
    back = np.loadtxt(result, delimiter=",", skiprows=1)
    assert np.array_equal(back[:, :6], table), "the rows come back as they went in"
    np.testing.assert_allclose(back[:, 6:], np.pi * np.array([[1, 2, 3]] * 500), rtol=2e-6)


def test_eval_accepts_what_spreadsheets_write(run_gridlight, constant_file, tmp_path):
    points, result = tmp_path / "p.csv", tmp_path / "e.csv"
    points.write_bytes("\ufeffx, y, z, nx, ny, nz\r\n 0, 0 ,0, 0,0,1e300\r\n\r\n1,1,1,0,0,1e-320\r\n".encode())
    done = run_gridlight("eval", constant_file, "--points", points, "-o", result)
    assert done.returncode == 0, done.stderr
    back = np.loadtxt(result, delimiter=",", skiprows=1)
    np.testing.assert_allclose(back[:, 6:], np.pi * np.array([[1, 2, 3]] * 2), rtol=2e-6)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["line 1", "header"]),
        ("1,2,3,0,0,1\n", ["line 1", "header"]),
        ("x,y,z\n", ["line 1", "header"]),
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n0,0,0,0,0\n", ["line 3", "six numbers"]),
        ("x,y,z,nx,ny,nz\n\n0,0,0,0,0,1,7\n", ["line 3", "six numbers"]),
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,one\n", ["line 2", "six numbers"]),
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,1\nnan,0,0,0,0,1\n", ["line 3", "not finite"]),
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,inf\n", ["line 2", "not finite"]),
        ("x,y,z,nx,ny,nz\n0,0,0,0,0,0\n", ["line 2", "length zero"]),
        ("x,y,z,nx,ny,nz\n0,0,1,0,0,1\n0,0,1e300,0,0,1\n", ["line 3", "farther away"]),
    ],
)
def test_eval_names_the_line_that_is_wrong(run_gridlight, constant_file, tmp_path, content, words):
    points, folder = tmp_path / "p.csv", tmp_path / "out"
    points.write_text(content)
    assert_one_line(
        run_gridlight("eval", constant_file, "--points", points, "-o", folder / "e.csv"), 2, "p.csv", *words
    )
    assert not folder.exists()


def test_eval_of_a_binary_file(run_gridlight, constant_file, tmp_path):
    done = run_gridlight("eval", constant_file, "--points", constant_file, "-o", tmp_path / "e.csv")
    assert_one_line(done, 2, "probes.exr")


def test_eval_without_points_warns(run_gridlight, constant_file, tmp_path):
    (tmp_path / "p.csv").write_text("x,y,z,nx,ny,nz\n")
    done = run_gridlight("eval", constant_file, "--points", tmp_path / "p.csv", "-o", tmp_path / "e.csv", "--quiet")
    assert done.returncode == 0 and "no points" in done.stderr
    assert (tmp_path / "e.csv").read_text() == "x,y,z,nx,ny,nz,Er,Eg,Eb\n"


def test_eval_keeps_the_old_result_when_it_fails(run_gridlight, constant_file, tmp_path):
    (tmp_path / "p.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,0\n")
    (tmp_path / "e.csv").write_text("old")
    assert (
        run_gridlight("eval", constant_file, "--points", tmp_path / "p.csv", "-o", tmp_path / "e.csv").returncode == 2
    )
    assert (tmp_path / "e.csv").read_text() == "old" and len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize(
    ("target", "words"),
    [("/proc/e.csv", ["/proc"]), ("{file}/e.csv", ["Not a directory"]), ("{folder}", ["is a folder"])],
)
def test_eval_into_places_that_cannot_be_written(run_gridlight, constant_file, tmp_path, target, words):
    (tmp_path / "p.csv").write_text("x,y,z,nx,ny,nz\n0,0,0,0,0,1\n")
    target = target.format(file=tmp_path / "p.csv", folder=tmp_path)
    assert_one_line(run_gridlight("eval", constant_file, "--points", tmp_path / "p.csv", "-o", target), 2, *words)


def test_eval_on_a_full_disk(constant_file, tmp_path):
    points, out = tmp_path / "p.csv", tmp_path / "out"
    points.write_text("x,y,z,nx,ny,nz\n" + "0,0,0,0,0,1\n" * 2000)
    done = run_on_a_full_disk(10_000, "eval", constant_file, "--points", points, "-o", out / "e.csv")
    assert_one_line(done, 2, "cannot write", "too large")
    assert not out.exists()


# Pipes
# ----------------------------------------------------------------------------------------------------------------------


def test_a_reader_that_leaves_gets_no_traceback(constant_file, root):
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(
        [sys.executable, "-I", str(root / "cli" / "__main__.py"), "info", str(constant_file)],
        stdout=write_end,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
        timeout=60,
    )
    os.close(write_end)
    assert done.returncode == 0 and done.stderr == ""


# Interrupts
# ----------------------------------------------------------------------------------------------------------------------


def wait_until_it_listens(pid):
    """Until the process has a handler for SIGTERM: before its first line, interrupts are the interpreter's."""
    for _ in range(1000):
        status = Path(f"/proc/{pid}/status").read_text()
        caught = int(next(line for line in status.splitlines() if line.startswith("SigCgt")).split()[1], 16)
        if caught >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.01)
    raise AssertionError("no handler for SIGTERM within ten seconds")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("delay", [0.0, 0.05, 0.15, 0.35, 0.65])
def test_an_interrupt_at_any_time_ends_eval_without_traceback(constant_file, tmp_path, root, delay, number):
    points, out = tmp_path / "p.csv", tmp_path / "out"
    points.write_text("x,y,z,nx,ny,nz\n" + "0,0,0,0,0,1\n" * 400_000)
    process = subprocess.Popen(
        [
            sys.executable,
            "-I",
            root / "cli" / "__main__.py",
            "eval",
            constant_file,
            "--points",
            points,
            "-o",
            out / "e.csv",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_until_it_listens(process.pid)
    time.sleep(delay)
    process.send_signal(number)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130 and errors.splitlines()[-1] == "gridlight: cancelled"
    assert "Traceback" not in errors and not output and not out.exists()


def test_an_interrupt_that_python_drops_stops_at_the_next_question(monkeypatch):
    """Exceptions of destructors come to nothing."""
    stop, dropped = Stop(), []
    monkeypatch.setattr(sys, "unraisablehook", lambda lost: dropped.append(lost.exc_type))

    class Interrupted:
        def __del__(self):
            stop.interrupt(signal.SIGINT, None)

    assert not stop()
    Interrupted()
    assert dropped == [KeyboardInterrupt] and stop()
