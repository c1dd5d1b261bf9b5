# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bake --relight`` as a user calls it: other files and frames, with counters that say what was kept."""

import bpy
import numpy as np
import pytest
from gridlight.formats import probe_file
from gridlight.tests.command_line import last_json

BOX = ["--min", "-1.5,-1.5,-1.5", "--max", "1.5,1.5,1.5", "--resolution", "3,3,3", "--face", 4, "--tolerance", "1e-6"]


def room(path, energy=50.0, crate=(1.0, 0.0, -1.0)):
    """A room with a crate and a lamp, which dims from frame 1 to frame 10."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=crate)
    bpy.ops.object.light_add(type="POINT", location=(0.3, 0.2, 0.5))
    lamp = bpy.context.object.data
    for frame, share in ((1, 1.0), (10, 0.25)):
        lamp.energy = energy * share
        lamp.keyframe_insert("energy", frame=frame)
    bpy.context.scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rooms")
    return {
        "base": room(folder / "base.blend"),
        "dimmed": room(folder / "dimmed.blend", energy=20.0),
        "moved": room(folder / "moved.blend", crate=(-1.0, 0.3, -1.0)),
    }


def coefficients(path):
    return probe_file.read(path).coefficients


@pytest.mark.any_version
def test_relighting_other_files_and_frames(run_gridlight, files, tmp_path):
    out, fresh = tmp_path / "out", tmp_path / "fresh"
    states = [files["dimmed"], files["moved"], "10"]
    done = run_gridlight(
        "bake", files["base"], "-o", out, *BOX, "--no-pictures", *(a for s in states for a in ("--relight", s))
    )
    assert done.returncode == 0, done.stderr
    summary = last_json(done)
    entries = summary["relight"]
    assert [entry["state"] for entry in entries] == [str(state) for state in states]
    assert [entry["file"] for entry in entries] == [str(out / f"probes_relit{i}.exr") for i in (1, 2, 3)]
    assert {entry["file"] for entry in entries} <= set(summary["files"])
    dimmed, moved, back = entries
    assert dimmed["changes"] == ["1 lights changed"]
    assert (dimmed["probes_captured"], dimmed["hierarchy"], dimmed["patches_traced"]) == (0, "kept", 0)
    assert 0 < moved["probes_captured"] and moved["hierarchy"] == "refit"
    assert back["hierarchy"] == "refit" and back["converged"]
    for state, entry in zip((["dimmed"], ["moved"], ["base", "--frame", 10]), entries):
        again = run_gridlight("bake", files[state[0]], *state[1:], "-o", fresh, *BOX, "--no-pictures")
        assert again.returncode == 0, again.stderr
        expected, found = coefficients(fresh / "probes.exr"), coefficients(entry["file"])
        np.testing.assert_allclose(found, expected, atol=1e-5 * np.abs(expected).max())


def test_a_state_that_is_missing_is_refused_at_once(run_gridlight, files, tmp_path):
    done = run_gridlight("bake", files["base"], "-o", tmp_path / "out", *BOX, "--relight", "none.blend")
    assert done.returncode == 2 and "none.blend: no such file" in done.stderr
    assert not (tmp_path / "out").exists()
