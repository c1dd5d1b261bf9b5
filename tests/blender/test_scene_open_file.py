# SPDX-License-Identifier: GPL-3.0-or-later
"""Files are data: nothing in them runs, and what is no .blend is refused in one line."""

import gzip
import os

import bpy
import pytest
from gridlight.core.errors import InputError
from gridlight.scene.open_file import open_blend, set_frame


@pytest.fixture
def blend(tmp_path):
    """Saves the current file and returns its path and bytes."""

    def save(name="scene.blend", compress=False):
        path = tmp_path / name
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=compress, copy=True)
        return path

    bpy.ops.wm.read_factory_settings(use_empty=False)
    return save


def test_scripts_and_drivers_in_a_file_never_run(blend, tmp_path):
    mark = tmp_path / "ran"
    text = bpy.data.texts.new("run_me.py")
    text.use_module = True
    text.write(f"open({str(mark)!r}, 'w').write('text')")
    driver = bpy.data.objects["Cube"].driver_add("location", 0).driver
    driver.type = "SCRIPTED"
    driver.expression = f"len([open({str(mark)!r}, 'w')])"
    scene = open_blend(blend())
    set_frame(scene, 7)
    bpy.context.evaluated_depsgraph_get().update()
    assert scene.frame_current == 7
    assert not mark.exists()


def test_the_driver_of_that_test_would_run_if_it_were_allowed(blend, tmp_path):
    mark = tmp_path / "ran"
    driver = bpy.data.objects["Cube"].driver_add("location", 0).driver
    driver.type = "SCRIPTED"
    driver.expression = f"len([open({str(mark)!r}, 'w')])"
    bpy.ops.wm.open_mainfile(filepath=str(blend()), load_ui=False, use_scripts=True)
    bpy.context.scene.frame_set(7)
    assert mark.exists()


@pytest.mark.parametrize("compress", [False, True])
def test_plain_and_compressed_files_open(blend, compress):
    path = blend(compress=compress)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert "Cube" in open_blend(path).objects


def test_gzip_files_of_old_blenders_open(blend):
    path = blend()
    path.write_bytes(gzip.compress(path.read_bytes()))
    assert "Cube" in open_blend(path).objects


def refused(path):
    with pytest.raises(InputError) as caught:
        open_blend(path)
    message = str(caught.value)
    assert str(path) in message and "\n" not in message and ";" in message
    return message


def test_missing_file_and_folder(tmp_path):
    assert "no such file" in refused(tmp_path / "nothing.blend")
    assert "folder" in refused(tmp_path)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"BLENDER",
        os.urandom(3000),
        b"BLENDER" + os.urandom(3000),
        b"BLENDER-v405" + bytes(3000),
        b"BLENDER17-01v0502" + os.urandom(3000),
        b"\x28\xb5\x2f\xfd" + os.urandom(3000),
        b"\x1f\x8b" + os.urandom(3000),
        gzip.compress(b"something else"),
        b"\x89PNG\r\n\x1a\n" + bytes(100),
    ],
    ids=[
        "empty",
        "magic",
        "noise",
        "magic-noise",
        "magic-zeros",
        "magic5-noise",
        "zstd-noise",
        "gzip-noise",
        "gzip-other",
        "png",
    ],
)
def test_what_is_no_blend_is_refused(tmp_path, content):
    path = tmp_path / "bad.blend"
    path.write_bytes(content)
    refused(path)


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("share", [0.01, 0.5, 0.99])
def test_truncated_files_are_refused(blend, compress, share):
    path = blend(compress=compress)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    refused(path)


def test_a_refused_file_leaves_the_current_one_alone(blend, tmp_path):
    open_blend(blend())
    bad = tmp_path / "bad.blend"
    bad.write_bytes(b"BLENDER-v405" + bytes(3000))
    refused(bad)
    assert "Cube" in bpy.data.objects


def test_a_frame_out_of_range_is_refused(blend):
    with pytest.raises(InputError, match="--frame"):
        set_frame(open_blend(blend()), 10**7)
