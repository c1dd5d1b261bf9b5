# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender -b FILE.blend --command gridlight …`` in the real Blender, from the installed zip."""

import json
import os
import subprocess

SETUP = """
import bpy, sys
package, blend = sys.argv[-2:]
bpy.ops.extensions.package_install_files(filepath=package, repo="user_default", enable_on_install=True)
bpy.ops.wm.save_userpref()
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.mesh.primitive_cube_add(size=4)
bpy.ops.object.light_add(type="POINT", location=(0.3, 0.2, 0.5))
bpy.ops.wm.save_as_mainfile(filepath=blend)
import OpenEXR, os
assert OpenEXR.__file__.startswith(os.environ["BLENDER_USER_RESOURCES"]), OpenEXR.__file__  # from the zip's wheel
"""


def test_bake_and_export_of_a_saved_file(full_blender_command, extension_zip, tmp_path):
    user, blend, out = tmp_path / "user", tmp_path / "room.blend", tmp_path / "out"
    (tmp_path / "setup.py").write_text(SETUP)
    settings = [f"BLENDER_USER_RESOURCES={user}", "LC_ALL=C.UTF-8", "PYTHONDONTWRITEBYTECODE=1"]
    blender = [*full_blender_command, "shell", "env", *settings, "blender", "-b"]

    def run(*arguments):
        command = [*blender, *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, env=os.environ)

    made = run("--factory-startup", "--python-exit-code", 1, "-P", tmp_path / "setup.py", "--", extension_zip, blend)
    assert made.returncode == 0 and blend.exists(), made.stdout + made.stderr
    box = ["--min", "-1,-1,-1", "--max", "1,1,1", "--resolution", "2,2,2", "--face", "4", "--keep-all", "--quiet"]
    baked = run(blend, "--command", "gridlight", "bake", "-o", out, *box)
    assert baked.returncode == 0, baked.stdout + baked.stderr
    summary = json.loads(baked.stdout.strip().splitlines()[-1])
    assert summary["probes"]["active"] == 8 and (out / "probes.exr").exists()
    exported = run("--command", "gridlight", "export", out / "probes.exr", "--to", "json", "-o", out / "probes.json")
    assert exported.returncode == 0 and (out / "probes.json").exists(), exported.stdout + exported.stderr
    refused = run("--command", "gridlight", "info", tmp_path / "none.exr")
    assert refused.returncode == 2 and "none.exr" in refused.stderr, refused.stdout + refused.stderr
