# SPDX-License-Identifier: GPL-3.0-or-later
"""What users install: the zip's contents, and the extension at work in a Blender that has nothing but the zip."""

import ast
import hashlib
import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ROOMS = {"core", "scene", "gpu_shaders", "bake", "formats", "viewport", "operators", "panels", "cli"}
SUFFIXES = {".py", ".glsl", ".css", ".js", ".html", ".json", ".cs"}  # sources, and what exports are made of
# What the wheels bring that is in the zip as well, or belongs to the test tools.
NOT_BLENDERS = re.compile(r"openexr|imath|openimageio|pytest|hypothesis|godot", re.IGNORECASE)
NETWORK = {"socket", "ssl", "http", "urllib", "ftplib", "requests", "smtplib", "xmlrpc"}


def build(folder: Path) -> dict[str, Path]:
    """Zips by platform."""
    done = subprocess.run(
        [sys.executable, "-I", str(ROOT / "scripts" / "build_zip.py"), "-o", str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return {Path(line).stem.split("-")[-1]: Path(line) for line in done.stdout.splitlines()}


@pytest.fixture(scope="module")
def zips(tmp_path_factory):
    return build(tmp_path_factory.mktemp("zips"))


@pytest.fixture(scope="module")
def manifest():
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))


def test_every_platform_gets_its_own_wheels_and_nothing_else(zips, manifest):
    assert set(zips) == {name.replace("-", "_") for name in manifest["platforms"]}
    systems = {"linux": "manylinux", "windows": "win", "macos": "macosx"}
    for platform, path in zips.items():
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
            generated = tomllib.loads(archive.read("blender_manifest.toml").decode())["build"]["generated"]
        wheels = [name for name in names if name.endswith(".whl")]
        assert generated["wheels"] == ["./" + name for name in wheels]
        assert all(f"-{systems[platform.split('_')[0]]}_" in name for name in wheels)
        pythons = {re.search(r"-(cp\d+)-", name)[1] for name in wheels}
        assert pythons == ({"cp311"} if platform == "macos_x64" else {"cp311", "cp313", "cp314"})
        sources = [Path(name) for name in names if name not in wheels]
        assert {path.parts[0] for path in sources if len(path.parts) > 1} == ROOMS
        assert {str(path) for path in sources if len(path.parts) == 1} == {
            "__init__.py",
            "LICENSE",
            "blender_manifest.toml",
        }
        assert {path.suffix for path in sources} <= SUFFIXES | {".toml", ""}
        assert not [path for path in sources if "bench" in str(path)]  # a developer's tools


def test_the_same_files_give_the_same_bytes(zips, tmp_path):
    again = build(tmp_path)
    for platform, path in zips.items():
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
        assert len({entry.date_time for entry in entries}) == 1
        assert [entry.filename for entry in entries] == sorted(entry.filename for entry in entries)
        assert hashlib.sha256(path.read_bytes()).digest() == hashlib.sha256(again[platform].read_bytes()).digest()


def test_wheels_are_the_pinned_ones(zips, manifest):
    pinned = re.findall(r"sha256:([0-9a-f]{64})", (ROOT / "requirements" / "wheels.txt").read_text())
    held = {hashlib.sha256((ROOT / name).read_bytes()).hexdigest() for name in manifest["wheels"]}
    assert held == set(pinned) and len(pinned) == len(manifest["wheels"])


def test_what_is_tested_is_what_is_shipped(manifest):
    """Tests and launcher used OpenEXR 3.4 once while the zip carried 3.5."""
    shipped = {name.split("-")[1] for name in manifest["wheels"]}
    pins = [(ROOT / "requirements" / name).read_text() for name in ("bpy45.txt", "bpy52.txt", "wheels.txt")]
    assert {re.search(r"^OpenEXR==(\S+)", pin, re.MULTILINE)[1] for pin in pins} == shipped and len(shipped) == 1


def test_rules_of_the_extensions_platform(zips, manifest):
    assert manifest["license"] == ["SPDX:GPL-3.0-or-later"] and set(manifest["permissions"]) == {"files"}
    assert "blender" not in manifest["name"].lower() and manifest["tagline"][-1].isalnum()
    with zipfile.ZipFile(zips["linux_x64"]) as archive:
        sources = {name: archive.read(name).decode() for name in archive.namelist() if name.endswith(".py")}
    for name, text in sources.items():
        tree = ast.parse(text)
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and node.attr == "path" and isinstance(node.value, ast.Name):
                assert node.value.id != "sys", f"{name}:{node.lineno} touches sys.path"
            if isinstance(node, (ast.Import, ast.ImportFrom)) and not getattr(node, "level", 0):
                modules = [node.module] if isinstance(node, ast.ImportFrom) else [item.name for item in node.names]
                assert not NETWORK & {module.split(".")[0] for module in modules}, f"{name}:{node.lineno}"
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "print":
                # The command line talks, on standard error; whoever works in the interface gets reports.
                assert name.startswith("cli/"), f"{name}:{node.lineno} prints"


USE = """
import contextlib, io, json, os, sys
def no_network(event, arguments):
    if event in ("socket.connect", "socket.getaddrinfo", "urllib.Request"):
        raise RuntimeError(f"asked the network: {event} {arguments}")
sys.addaudithook(no_network)
import bpy
import addon_utils
package, folder = sys.argv[1:]
name = "bl_ext.user_default.gridlight"
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.extensions.package_install_files(filepath=package, repo="user_default", enable_on_install=True)
assert name in bpy.context.preferences.addons
import OpenEXR
assert OpenEXR.__file__.startswith(os.environ["BLENDER_USER_RESOURCES"]), OpenEXR.__file__
from bl_ext.user_default.gridlight import cli
bpy.ops.mesh.primitive_cube_add(size=4)
bpy.ops.object.light_add(type="POINT", location=(0.3, 0.2, 0.5))
for words in (
    "bake -o {0} --min -1,-1,-1 --max 1,1,1 --resolution 2,2,2 --face 4 --keep-all --quiet",
    "info {0}/probes.exr",
    "export {0}/probes.exr --to json -o {0}/probes.json",
    "export {0}/probes.exr --to three -o {0}/web",
    "diff {0}/probes.exr {0}/probes.exr",
):
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        status = cli._execute(words.format(folder).split())
    assert status == 0, (words, status)
    json.loads(said.getvalue().splitlines()[-1])
addon_utils.disable(name)
addon_utils.enable(name)
addon_utils.disable(name)
every = [getattr(bpy.app.handlers, kind) for kind in dir(bpy.app.handlers)]
lists = [value for value in every if isinstance(value, list)]
left = [handler for handlers in lists for handler in handlers if handler.__module__.startswith(name)]
assert not left, left
print("used", flush=True)
os._exit(0)
"""


def test_installed_from_the_zip_alone_it_bakes_and_exports_without_a_network(zips, tmp_path, gpu_context):
    """The Python has Blender and what Blender ships, but no OpenEXR: that must come from the zip's wheel."""
    site = tmp_path / "site"
    site.mkdir()
    for item in Path(sysconfig.get_path("purelib")).iterdir():
        if not NOT_BLENDERS.search(item.name):
            (site / item.name).symlink_to(item)
    out = tmp_path / "out"
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user"), "PYTHONPATH": str(site)}
    done = subprocess.run(
        [sys.executable, "-S", "-P", "-c", USE, str(zips["linux_x64"]), str(out)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0 and "used" in done.stdout, done.stdout + done.stderr
    # Blender says that it installed something; nothing else may be said by being installed and enabled.
    before_the_bake = done.stdout.splitlines()[0]
    assert before_the_bake == 'STATUS Installed "gridlight"', done.stdout
    assert "gridlight:" not in done.stdout and "Warning" not in done.stderr, done.stdout + done.stderr
    assert json.loads((out / "probes.json").read_text()) and (out / "web" / "index.html").exists()
