# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bake`` and ``demo`` as a user calls them: files, summary, bad input, interrupts, machines without a
driver."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time

import bpy
import numpy as np
import pytest
from gridlight.core.conventions import ACTIVE, CULLED
from gridlight.formats import probe_file

SUMMARY_KEYS = [
    "probes",
    "invalid_because",
    "iterations",
    "converged",
    "ringing",
    "seconds",
    "device",
    "settings",
    "files",
    "warnings",
]
BOX = ["--min", "-1.5,-1.5,-1.5", "--max", "1.5,1.5,1.5", "--resolution", "3,3,3"]
FAST = ["--face", "4", "--no-pictures"]


def save(path, *builders):
    """A .blend at ``path`` with what ``builders`` add to an empty scene."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for build in builders:
        build()
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def room(size=4.0):
    """A closed box around the origin, seen from inside."""
    bpy.ops.mesh.primitive_cube_add(size=size)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.flip_normals()
    bpy.ops.object.mode_set(mode="OBJECT")


def lamp():
    bpy.ops.object.light_add(type="POINT", location=(0.3, 0.2, 0.5))
    bpy.context.object.data.energy = 50


def volume(name, location):
    def add():
        bpy.ops.object.empty_add(type="CUBE", location=location, radius=0.5)
        bpy.context.object.name = name
        bpy.context.object["gridlight_volume"] = 1
        bpy.context.object["gridlight_resolution"] = [2, 2, 2]

    return add


@pytest.fixture(scope="module")
def lit_room(tmp_path_factory):
    return save(tmp_path_factory.mktemp("scenes") / "room.blend", room, lamp)


def summary_of(done):
    summary = json.loads(done.stdout.splitlines()[-1])
    assert list(summary) == SUMMARY_KEYS
    return summary


def assert_one_line(done, status, *words):
    lines = done.stderr.splitlines()
    assert done.returncode == status and len(lines) == 1 and not done.stdout, (
        done.returncode,
        done.stdout,
        done.stderr,
    )
    for word in words:
        assert word in lines[0]


def test_bake_writes_its_files_and_says_so(run_gridlight, lit_room, tmp_path):
    before = hashlib.sha256(lit_room.read_bytes()).hexdigest(), sorted(os.listdir(lit_room.parent))
    done = run_gridlight("bake", lit_room, "-o", tmp_path / "out", *BOX, "--face", 8)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 1
    summary = summary_of(done)
    assert sorted(os.listdir(tmp_path / "out")) == ["preview.png", "preview_probes.png", "probes.exr", "report.html"]
    assert sorted(summary["files"]) == sorted(str(path) for path in (tmp_path / "out").iterdir())
    assert list(summary["seconds"]) == ["setup", "read", "cull", "capture", "light", "write", "total"]
    assert sum(list(summary["seconds"].values())[:-1]) <= summary["seconds"]["total"]
    assert summary["probes"]["total"] == 27 and summary["converged"] and summary["iterations"] > 1
    assert summary["settings"]["face"] == 8 and summary["settings"]["bounces"] == "auto"
    field = probe_file.read(tmp_path / "out" / "probes.exr")
    assert field.grid.resolution == (3, 3, 3)
    assert {
        key: int((field.state == value).sum()) for key, value in (("active", ACTIVE), ("culled", CULLED))
    }.items() <= summary["probes"].items()
    assert (field.coefficients[field.state == ACTIVE, 0] > 0).all()
    assert field.metadata["settings"] == summary["settings"] and field.metadata["converged"] is True
    assert (hashlib.sha256(lit_room.read_bytes()).hexdigest(), sorted(os.listdir(lit_room.parent))) == before


def test_two_bakes_give_the_same_bytes_and_quiet_is_quiet(run_gridlight, lit_room, tmp_path):
    for name in ("a", "b"):
        done = run_gridlight("bake", lit_room, "-o", tmp_path / name, *BOX, "--no-pictures", "--quiet")
        assert (done.returncode, done.stderr) == (0, "")
        assert sorted(os.listdir(tmp_path / name)) == ["probes.exr", "report.html"]
    assert (tmp_path / "a" / "probes.exr").read_bytes() == (tmp_path / "b" / "probes.exr").read_bytes()


@pytest.mark.any_version
def test_several_volumes_give_a_file_each(run_gridlight, tmp_path):
    blend = save(tmp_path / "two.blend", room, lamp, volume("Hall/ü", (0.5, 0, 0)), volume("Hall: ü", (-0.5, 0, 0)))
    done = run_gridlight("bake", blend, "-o", tmp_path / "out", *FAST, "--keep-all", "--resolution", "2,3,2")
    assert done.returncode == 0, done.stderr
    files = sorted(path.name for path in (tmp_path / "out").glob("*.exr"))
    assert files == ["probes_Hall_ü.exr", "probes_Hall_ü_2.exr"]
    assert summary_of(done)["probes"] == {"total": 24, "active": 24, "culled": 0, "invalid": 0}
    fields = [probe_file.read(tmp_path / "out" / name) for name in files]
    assert {field.grid.name for field in fields} == {"Hall/ü", "Hall: ü"}
    assert all(field.grid.resolution == (2, 3, 2) for field in fields)


@pytest.mark.any_version
def test_spacing_and_fitted_volume(run_gridlight, lit_room, tmp_path):
    done = run_gridlight(
        "bake",
        lit_room,
        "-o",
        tmp_path / "a",
        "--min",
        "-1,-1,-1",
        "--max",
        "1,1,0",
        "--spacing",
        "0.5",
        "--keep-all",
        *FAST,
    )
    assert summary_of(done)["probes"]["total"] == 5 * 5 * 3
    done = run_gridlight("bake", lit_room, "-o", tmp_path / "b", "--spacing", "2", *FAST)
    assert done.returncode == 0 and summary_of(done)["probes"]["total"] >= 8


@pytest.mark.any_version
def test_a_scene_without_light_warns_and_is_black(run_gridlight, tmp_path):
    blend = save(tmp_path / "dark.blend", room)
    done = run_gridlight("bake", blend, "-o", tmp_path / "out", *BOX, *FAST, "--quiet")
    assert done.returncode == 0
    assert len(done.stderr.splitlines()) == 1 and "no light" in done.stderr and "dd a light" in done.stderr
    assert any("no light" in warning for warning in summary_of(done)["warnings"])
    assert not probe_file.read(tmp_path / "out" / "probes.exr").coefficients.any()


def mirror_room():
    """A closed box that reflects everything and emits: its light never settles."""
    room()
    material = bpy.data.materials.new("white")
    material.use_nodes = True
    principled = material.node_tree.nodes["Principled BSDF"]
    principled.inputs["Base Color"].default_value = (1, 1, 1, 1)
    principled.inputs["Emission Color"].default_value = (1, 1, 1, 1)
    principled.inputs["Emission Strength"].default_value = 1
    bpy.context.object.data.materials.append(material)


@pytest.mark.any_version
def test_light_that_never_settles_ends_with_status_4_and_files(run_gridlight, tmp_path):
    blend = save(tmp_path / "white.blend", mirror_room)
    done = run_gridlight("bake", blend, "-o", tmp_path / "out", *BOX, *FAST, "--keep-all")
    assert done.returncode == 4, done.stderr
    summary = summary_of(done)
    assert summary["converged"] is False and any("settled" in warning for warning in summary["warnings"])
    assert probe_file.read(tmp_path / "out" / "probes.exr").metadata["converged"] is False


# --- bad input
# ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["missing", "truncated", "text", "empty file", "folder", "empty scene", "hidden"])
def test_files_that_cannot_be_baked(run_gridlight, lit_room, tmp_path, kind):
    blend = tmp_path / "bad.blend"
    words = ["bad.blend"]
    if kind == "truncated":
        blend.write_bytes(lit_room.read_bytes()[: lit_room.stat().st_size // 2])
    elif kind == "text":
        blend.write_text("hello")
    elif kind == "empty file":
        blend.write_bytes(b"")
    elif kind == "folder":
        blend.mkdir()
    elif kind == "empty scene":
        save(blend)
        words = ["no surface"]
    elif kind == "hidden":
        save(blend, room, lambda: setattr(bpy.context.object, "hide_render", True))
        words = ["no surface"]
    assert_one_line(run_gridlight("bake", blend, "-o", tmp_path / "out", *BOX), 2, *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.any_version
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--min", "0,0,0", "--max", "0,1,1", "--resolution", "2,2,2"], ["no size along X"]),
        (["--min", "0,0,0", "--max", "1,-1,1", "--resolution", "2,2,2"], ["no size along Y"]),
        (["--min", "0,0,0", "--max", "1,1,1", "--resolution", "0,2,2"], ["0,2,2", "1 to 256"]),
        (["--min", "0,0,0", "--max", "1,1,1", "--resolution", "1000000,2,2"], ["1000000", "1 to 256"]),
        (["--min", "0,0,0", "--max", "1,1,1", "--spacing", "1e-12"], ["1 to 256"]),
        (["--resolution", "0,2,2"], ["0,2,2", "1 to 256"]),
        (["--min", "0,0,0", "--max", "1,1,1", "--resolution", "256,256,256"], ["MiB"]),
        (["--frame", "99999999"], ["--frame"]),
    ],
)
def test_volumes_that_make_no_sense(run_gridlight, lit_room, tmp_path, options, words):
    assert_one_line(run_gridlight("bake", lit_room, "-o", tmp_path / "out", *options), 2, *words)
    assert not (tmp_path / "out").exists()


@pytest.mark.any_version
def test_a_volume_of_the_file_without_size(run_gridlight, tmp_path):
    def flat():
        volume("Flat", (0, 0, 0))()
        bpy.context.object.scale = (1, 1, 0)

    blend = save(tmp_path / "flat.blend", room, lamp, flat)
    assert_one_line(run_gridlight("bake", blend, "-o", tmp_path / "out"), 2, "Flat", "Z")


@pytest.mark.any_version
@pytest.mark.parametrize("target", ["/proc/out", "{file}/out", "{file}"])
def test_folders_that_cannot_be_written(run_gridlight, lit_room, tmp_path, target):
    done = run_gridlight("bake", lit_room, "-o", target.format(file=lit_room), *BOX)
    assert_one_line(done, 2, "cannot write")  # one line: found out before any work was reported


@pytest.mark.any_version
def test_a_full_disk_leaves_nothing(lit_room, tmp_path, root):
    """A limit on the size of files stands for the disk: writing beyond it fails the same way."""
    program = (
        "import resource, runpy, signal, sys\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))\n"
        f"sys.argv = ['gridlight', *sys.argv[1:]]; runpy.run_path({str(root / 'cli' / '__main__.py')!r}, "
        "run_name='__main__')\n"
    )
    done = subprocess.run(
        [sys.executable, "-I", "-c", program, "bake", lit_room, "-o", tmp_path / "out", *BOX, "--quiet"],
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )
    assert_one_line(done, 2, "cannot write")
    assert not list(tmp_path.iterdir())


# --- interrupts
# --------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def long_bake(tmp_path_factory):
    """Command line of a bake that takes minutes, without its output folder."""
    blend = save(tmp_path_factory.mktemp("scenes") / "long.blend", room, lamp)
    return [
        "bake",
        blend,
        "--min",
        "-1,-1,-1",
        "--max",
        "1,1,1",
        "--resolution",
        "40,40,40",
        "--keep-all",
        "--face",
        "32",
        "--tolerance",
        "1e-6",
        "--memory",
        "64",
    ]


@pytest.mark.parametrize("delay", [*(pytest.param(d, marks=pytest.mark.any_version) for d in (0.25, 0.6, 4.0)), 1.5])
@pytest.mark.parametrize("whole_group", [False, True], ids=["parent", "group"])
def test_one_interrupt_ends_it_cleanly(long_bake, root, tmp_path, delay, whole_group):
    """As a terminal delivers Ctrl-C (to the whole process group) and as ``kill -INT`` does (to the parent)."""
    process = subprocess.Popen(
        [sys.executable, "-I", root / "cli" / "__main__.py", *long_bake, "-o", tmp_path / "out"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    time.sleep(delay)
    (os.killpg if whole_group else os.kill)(process.pid, signal.SIGINT)
    started = time.monotonic()
    output, errors = process.communicate(timeout=60)
    assert process.returncode == 130, errors
    assert time.monotonic() - started < 10
    assert "Traceback" not in errors and not output
    assert not list(tmp_path.iterdir())


def test_the_child_ends_when_the_parent_is_killed(long_bake, root, tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-I", root / "cli" / "__main__.py", *long_bake, "-o", tmp_path / "out"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    time.sleep(2)
    children = open(f"/proc/{process.pid}/task/{process.pid}/children").read().split()
    assert len(children) == 1
    process.kill()
    process.wait()
    for _ in range(100):
        if not os.path.exists(f"/proc/{children[0]}/exe"):
            break
        time.sleep(0.2)
    else:
        os.kill(int(children[0]), signal.SIGKILL)
        pytest.fail("the child went on without its parent")


# --- machines without a driver
# -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "missing",
    [{"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}, {"LIBGL_DRIVERS_PATH": "/nonexistent"}],
    ids=["no EGL vendor", "no Mesa driver"],
)
def test_no_gpu_context_is_status_3_and_one_line(run_gridlight, lit_room, tmp_path, missing):
    done = run_gridlight("bake", lit_room, "-o", tmp_path / "out", *BOX, "--quiet", env={**os.environ, **missing})
    assert_one_line(done, 3, "no usable GPU context", "install")
    assert not (tmp_path / "out").exists()


# --- the .blend is data
# ------------------------------------------------------------------------------------------------


def test_nothing_inside_the_file_is_run(run_gridlight, tmp_path):
    """A text block marked to register and a scripted driver would each write a file."""
    proof = tmp_path / "proof"

    def trap():
        text = bpy.data.texts.new("trap.py")
        text.write(f"open({str(proof)!r}, 'w').write('text')\n")
        text.use_module = True
        driver = bpy.context.object.driver_add("location", 0).driver
        driver.type = "SCRIPTED"
        driver.expression = f"__import__('builtins').open({str(proof)!r}, 'w').write('driver') and 0"

    blend = save(tmp_path / "trap.blend", room, lamp, trap)
    proof.unlink(missing_ok=True)  # building it may have evaluated the driver
    done = run_gridlight("bake", blend, "-o", tmp_path / "out", *BOX, *FAST)
    assert done.returncode == 0, done.stderr
    assert not proof.exists()


@pytest.mark.any_version
def test_names_from_the_file_are_escaped_in_the_report(run_gridlight, tmp_path):
    blend = save(tmp_path / "name.blend", room, lamp, volume("<script>alert(1)</script>", (0, 0, 0)))
    done = run_gridlight("bake", blend, "-o", tmp_path / "out", "--keep-all", "--face", 4)
    assert done.returncode == 0, done.stderr
    assert "<script>alert" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


# --- demo
# --------------------------------------------------------------------------------------------------------------


@pytest.mark.any_version
def test_demo(run_gridlight, tmp_path):
    done = run_gridlight("demo", "-o", tmp_path / "demo")
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 1
    summary = summary_of(done)
    assert summary["probes"] == {"total": 308, "active": 295, "culled": 13, "invalid": 0} and summary["converged"]
    assert sorted(os.listdir(tmp_path / "demo")) == [
        "gallery.blend",
        "preview.png",
        "preview_probes.png",
        "probes.exr",
        "report.html",
    ]
    field = probe_file.read(tmp_path / "demo" / "probes.exr")
    assert np.isfinite(field.coefficients).all() and (field.coefficients[:, 0] >= 0).all()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "demo" / "gallery.blend"), use_scripts=False)
    probes = [item for item in bpy.data.objects if "gridlight_probe_index" in item]
    assert len(probes) == 295
