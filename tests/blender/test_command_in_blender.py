# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender --command gridlight …``: the same commands inside a running Blender, which must survive all of them."""

import json

import bpy
import gridlight.cli
import pytest
from gridlight.core.field import Field
from gridlight.core.grid import Grid
from gridlight.formats import probe_file


def execute(capfd, *words):
    """(exit status, standard output, standard error) of the command as Blender calls it."""
    capfd.readouterr()
    status = gridlight.cli._execute(list(map(str, words)))
    return status, *capfd.readouterr()


def test_info(capfd, tmp_path):
    probe_file.write(tmp_path / "probes.exr", Field.empty(Grid.from_bounds((0, 0, 0), (1, 1, 1), (2, 2, 2)), 2))
    status, output, _ = execute(capfd, "info", tmp_path / "probes.exr")
    assert status == 0 and json.loads(output.splitlines()[-1])["probes"]["total"] == 8


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ([], 2),
        (["nonsense"], 2),
        (["--help"], 0),
        (["bake", "--help"], 0),
        (["info", "none.exr"], 2),
        (["bake", "none.blend", "-o", "out"], 2),
    ],
)
def test_endings_that_must_not_end_blender(capfd, words, status):
    assert execute(capfd, *words)[0] == status


def test_bake_of_the_open_file(capfd, tmp_path, gpu_context):
    """Without FILE the scene that is open is baked, as it is, saved or not."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT", location=(0.3, 0.2, 0.5))
    objects = sorted(bpy.data.objects.keys())
    status, output, errors = execute(
        capfd,
        "bake",
        "-o",
        tmp_path,
        "--min",
        "-1,-1,-1",
        "--max",
        "1,1,1",
        "--resolution",
        "2,2,2",
        "--face",
        4,
        "--keep-all",
        "--quiet",
    )
    assert status == 0, errors
    assert json.loads(output.splitlines()[-1])["probes"]["active"] == 8
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "preview.png",
        "preview_probes.png",
        "probes.exr",
        "report.html",
    ]
    assert sorted(bpy.data.objects.keys()) == objects and not bpy.data.filepath
