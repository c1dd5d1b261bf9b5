# SPDX-License-Identifier: GPL-3.0-or-later
"""A small scene, its plain bake, and jobs for it. Shards are cheap: eight probes each over a floor under the sky."""

import argparse
import subprocess
import sys
from pathlib import Path

import bpy
import pytest
from gridlight.cli import arguments as command_line
from gridlight.cli import bake as bake_command
from gridlight.cli.progress import Reporter
from gridlight.farm import plan as plan_command

ROOT = Path(__file__).resolve().parents[2]
FARM = ROOT / "farm" / "__main__.py"
OPTIONS = "--min -2,-2,0.2 --max 2,2,1.4 --resolution 4,4,2 --face 4 --block 8 --keep-all --capture trace".split()


@pytest.fixture(scope="session")
def farm_scene(tmp_path_factory):
    """A .blend whose lamp moves from frame 1 to 3 while nothing else does."""
    path = tmp_path_factory.mktemp("farm") / "floor.blend"
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_plane_add(size=6)
    bpy.ops.mesh.primitive_cube_add(size=1, location=(0.4, 0.3, 0.5))
    bpy.ops.object.light_add(type="POINT", location=(-1.3, 0.2, 2.1))
    lamp = bpy.context.object
    lamp.data.energy = 100
    lamp.keyframe_insert("location", frame=1)
    lamp.location.x = 1.0
    lamp.keyframe_insert("location", frame=3)
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True)
    return path


def parsed(module, *words):
    """``words`` as the command of ``module`` reads them."""
    parser = argparse.ArgumentParser()
    module.add_arguments(parser, in_blender=False)
    return parser.parse_args(command_line.join_signed_values([str(word) for word in words]))


@pytest.fixture(scope="session")
def plain(farm_scene, gpu_context, tmp_path_factory):
    """Bytes of the probe file that ``gridlight bake`` writes at a frame."""
    known = {}

    def bytes_at(frame=1):
        if frame not in known:
            folder = tmp_path_factory.mktemp("plain")
            args = parsed(bake_command, farm_scene, "-o", folder, *OPTIONS, "--frame", frame, "--no-pictures")
            bake_command.run(args, Reporter(quiet=True), lambda: False)
            known[frame] = (folder / "probes.exr").read_bytes()
        return known[frame]

    return bytes_at


@pytest.fixture
def planned(farm_scene, gpu_context, tmp_path):
    """Makes a job, in this process; returns its folder and what the command had to say."""

    def make(*options):
        words = (farm_scene, "-o", tmp_path / "job", *OPTIONS, "--no-calibration", "--quiet", *options)
        args = parsed(plan_command, *words)
        plan_command.run(args, Reporter(quiet=True), lambda: False)
        return tmp_path / "job"

    return make


@pytest.fixture(scope="session")
def farm_command():
    """Runs ``gridlight farm`` with arguments in this environment's Python."""

    def run(*arguments, **options):
        command = [sys.executable, "-I", str(FARM), *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, **options)

    return run


@pytest.fixture(scope="session")
def dask_python():
    """The Python of the farm's own environment, which the launcher makes."""
    done = subprocess.run([ROOT / "gridlight", "farm", "run", "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return ROOT / ".venv-farm" / "bin" / "python"
