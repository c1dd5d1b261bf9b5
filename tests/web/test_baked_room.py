# SPDX-License-Identifier: GPL-3.0-or-later
"""From a .blend to pixels in three.js: bake, export with the scene, open the viewer, compare with ``eval``."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from export_fields import Y_UP
from gridlight.formats import probe_file
from gridlight.tests.command_line import last_json
from viewer_pixels import measured, where_it_looks

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def room(tmp_path_factory, run_gridlight):
    """Folder with room.blend, bake/probes.exr and the viewer in web/."""
    folder = tmp_path_factory.mktemp("room")
    blend = folder / "room.blend"
    subprocess.run([sys.executable, "-I", HERE / "build_room.py", blend], check=True, capture_output=True, timeout=120)
    volume = ["--min", "-1.8,-2.3,0.2", "--max", "1.8,2.3,2.8", "--resolution", "5,6,5", "--no-pictures"]
    done = run_gridlight("bake", blend, "-o", folder / "bake", *volume, "--quiet")
    assert done.returncode == 0, done.stderr
    done = run_gridlight("export", folder / "bake/probes.exr", "--to", "three", "-o", folder / "web", "--scene", blend)
    assert done.returncode == 0, done.stderr
    assert {"scene.glb", "scene.json"} <= {Path(name).name for name in last_json(done)["files"]}
    return folder


def evaluated(run_gridlight, folder, points, normals, probes="bake/probes.exr"):
    """Irradiance that the command ``eval`` gives."""
    table = np.concatenate([points, normals], axis=1)
    np.savetxt(folder / "p.csv", table, delimiter=",", header="x,y,z,nx,ny,nz", comments="", fmt="%.9g")
    done = run_gridlight("eval", folder / probes, "--points", folder / "p.csv", "-o", folder / "e.csv", "--quiet")
    assert done.returncode == 0, done.stderr
    return np.loadtxt(folder / "e.csv", delimiter=",", skiprows=1)[:, 6:]


def test_pixels_of_the_baked_room_agree_with_eval(browse, run_gridlight, room):
    """But for gradients, which the atlas does not hold."""
    field = probe_file.read(room / "bake/probes.exr")
    field.gradient[:] = 0
    probe_file.write(room / "plain.exr", field)
    places, normals, found = measured(browse, room / "web", reach=0.35)
    about = json.loads((room / "web/probes.json").read_text())
    points, among = where_it_looks(places, normals, about)
    assert among.sum() >= 200
    expected = evaluated(run_gridlight, room, points[among], normals[among] @ Y_UP, "plain.exr")
    error = np.abs(found[among] - expected).max(axis=1) / expected.max(axis=1)
    assert (error < 0.02).all(), f"worst {error.max():.3g} of {among.sum()} pixels"
    assert np.ptp(expected[:, 0]) > 0.3 * expected[:, 0].mean(), "the room's light is not the same everywhere"


def test_refined_they_agree_at_the_surface_itself(browse, run_gridlight, room):
    """With eight times smaller cells three.js looks so close to the walls that no shift needs to be allowed for, also
    in corners: ``eval`` finds there, as everywhere in a convex room, that every probe sees every place."""
    probes, folder = room / "bake/probes.exr", room / "fine"
    done = run_gridlight("export", probes, "--to", "three", "-o", folder, "--refine", 8, "--scene", room / "room.blend")
    assert done.returncode == 0, done.stderr
    places, normals, found = measured(browse, folder, reach=0.35)
    lit = (found > 0).any(axis=1)
    assert lit.sum() >= 200
    expected = evaluated(run_gridlight, room, places[lit] @ Y_UP, normals[lit] @ Y_UP)
    error = np.abs(found[lit] - expected).max(axis=1) / expected.max(axis=1)
    assert (error < 0.02).mean() > 0.98 and error.max() < 0.05, f"{(error < 0.02).mean()}, worst {error.max()}"


def test_the_glb_is_valid(packages, node, room):
    report = node(HERE / "validate_glb.mjs", room / "web/scene.glb")
    assert report["issues"]["numErrors"] == 0, report["issues"]["messages"]
    assert report["info"]["totalTriangleCount"] == 12 and report["info"]["materialCount"] == 6


def test_lamps_and_camera_come_along(room):
    about = json.loads((room / "web/scene.json").read_text())
    (lamp,) = about["lamps"]
    assert lamp["kind"] == "spot" and lamp["stands_in_for"] == "area"
    np.testing.assert_allclose(lamp["position"], [0.4, 2.95, -0.6], atol=1e-6)
    np.testing.assert_allclose(lamp["direction"], [0, -1, 0], atol=1e-6)
    np.testing.assert_allclose(lamp["color"], [60 / np.pi] * 3, rtol=1e-5)  # W/(πA) · A
    np.testing.assert_allclose(about["camera"]["position"], [0, 1.5, 2.3], atol=1e-5)
    np.testing.assert_allclose(about["camera"]["forward"], [0, 0, -1], atol=1e-5)
