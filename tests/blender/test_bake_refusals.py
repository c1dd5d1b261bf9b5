# SPDX-License-Identifier: GPL-3.0-or-later
"""What ``gridlight bake`` refuses in one line: files, volumes and folders that will not do, a full disk, no driver."""

import os

import bpy
import pytest
from bake_command import BOX, lamp, room, save, volume
from gridlight.tests.command_line import assert_one_line, run_on_a_full_disk


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
def test_a_full_disk_leaves_nothing(lit_room, tmp_path):
    done = run_on_a_full_disk(4096, "bake", lit_room, "-o", tmp_path / "out", *BOX, "--quiet")
    assert_one_line(done, 2, "cannot write")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "missing",
    [{"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}, {"LIBGL_DRIVERS_PATH": "/nonexistent"}],
    ids=["no EGL vendor", "no Mesa driver"],
)
def test_no_gpu_context_is_status_3_and_one_line(run_gridlight, lit_room, tmp_path, missing):
    done = run_gridlight("bake", lit_room, "-o", tmp_path / "out", *BOX, "--quiet", env={**os.environ, **missing})
    assert_one_line(done, 3, "no usable GPU context", "install")
    assert not (tmp_path / "out").exists()
