# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bake`` and ``demo`` as a user calls them: files, summary, and a .blend that is data and no program."""

import hashlib
import os

import bpy
import numpy as np
import pytest
from bake_command import BOX, FAST, eevee_volume, lamp, room, save, summary_of, volume
from gridlight.core.conventions import ACTIVE, CULLED
from gridlight.formats import probe_file


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
def test_spacing_and_fitted_volume(run_gridlight, tmp_path):
    """And that volumes of EEVEE's, which nobody reads, do not go without a word."""
    room_of_eevee = save(tmp_path / "room.blend", room, lamp, eevee_volume)
    done = run_gridlight(
        "bake",
        room_of_eevee,
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
    assert summary_of(done)["probes"]["total"] == 5 * 5 * 3 and not summary_of(done)["warnings"]
    done = run_gridlight("bake", room_of_eevee, "-o", tmp_path / "b", "--spacing", "2", *FAST)
    assert done.returncode == 0 and summary_of(done)["probes"]["total"] >= 8
    (warning,) = summary_of(done)["warnings"]
    assert "EEVEE" in warning and "(Volume)" in warning and "Gridlight Volume" in warning


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
