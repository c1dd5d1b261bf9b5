# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension's zips, one a platform: ``build_zip.py [-o FOLDER]`` in the launcher's environment.

Blender's own builder does the work: it reads ``blender_manifest.toml``, leaves out what that excludes, and gives every
platform its wheels. Around it, this script

* fetches the wheels into ``wheels/``, by name and pinned hash (``requirements/wheels.txt``);
* builds from a copy without what git ignores, so that nothing lying about gets in;
* writes each zip anew in a fixed order with a fixed date: the same files give the same bytes;
* lets every Blender that the launcher has made an environment for validate what came out.

Prints the path of each zip. Exit status 2 and one line where something is missing.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MANIFEST = "blender_manifest.toml"
PINS = ROOT / "requirements" / "wheels.txt"
WHEELS = ROOT / "wheels"
PROGRAM = "*/scripts/addons_core/bl_pkg/cli/blender_ext.py"  # in a Blender
DATE = (2026, 1, 1, 0, 0, 0)  # of every file in a zip
FILE_MODE = 0o100644 << 16  # a plain file that everybody may read


class BuildError(Exception):
    """One line for the user."""


def main() -> int:
    parser = argparse.ArgumentParser(prog="build_zip.py", description="Builds the extension's zips, one a platform.")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "out" / "zip", help="folder (default: out/zip)")
    try:
        for path in build(parser.parse_args().output):
            print(path)
    except BuildError as error:
        print(f"build_zip: {error}", file=sys.stderr)
        return 2
    return 0


def build(output: Path) -> list[Path]:
    """Builds all platforms' zips in ``output``, which is made, and returns their paths.

    Raises:
        BuildError: a wheel cannot be had, or Blender refuses the manifest or a zip.
    """
    manifest = tomllib.loads((ROOT / MANIFEST).read_text(encoding="utf-8"))
    wheels = [Path(name).name for name in manifest["wheels"]]
    fetch_wheels(wheels)
    output.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="gridlight-zip-") as scratch:
        source, built = Path(scratch, "source"), Path(scratch, "built")
        _copy_source(source)
        (source / "wheels").mkdir()
        for name in wheels:
            shutil.copyfile(WHEELS / name, source / "wheels" / name)
        built.mkdir()
        options = ["--split-platforms", "--source-dir", str(source), "--output-dir", str(built)]
        _extension(_own_program(), "build", *options)
        done = []
        for path in sorted(built.glob("*.zip")):
            _write_reproducibly(path, output / path.name)
            for program in _programs():
                _extension(program, "validate", str(output / path.name))
            done.append(output / path.name)
    return done


def fetch_wheels(names: list[str]) -> None:
    """Brings the named wheels into ``wheels/``; those that are there with their pinned hash are kept."""
    pinned = set(re.findall(r"--hash=sha256:([0-9a-f]{64})", PINS.read_text(encoding="utf-8")))
    WHEELS.mkdir(exist_ok=True)
    for name in names:
        path = WHEELS / name
        if path.exists() and _sha256(path) in pinned:
            continue
        _, _, python, abi, platform = path.stem.split("-")
        options = ["--python-version", python.removeprefix("cp"), "--implementation", "cp", "--abi", abi]
        options += ["--platform", platform, "--only-binary", ":all:", "--no-deps", "--require-hashes"]
        command = [sys.executable, "-I", "-m", "pip", "--disable-pip-version-check", "--no-input", "download", "-q"]
        with tempfile.TemporaryDirectory(dir=WHEELS) as folder:  # whole or not at all: another build may look for it
            done = subprocess.run(
                [*command, *options, "-r", str(PINS), "-d", folder], stdout=sys.stderr.fileno(), check=False
            )
            if done.returncode or not Path(folder, name).exists():
                raise BuildError(f"pip cannot fetch {name}; the lines above say why. Check the network and {PINS}")
            Path(folder, name).replace(path)


def _copy_source(target: Path) -> None:
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if listed.returncode:
        raise BuildError(f"{ROOT} is no git checkout, and what git ignores must stay out; clone the repository")
    for name in filter(None, listed.stdout.split("\0")):
        if (ROOT / name).is_file():  # not one that was deleted and not committed yet
            (target / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, target / name)


def _own_program() -> Path:
    """Blender's ``extension`` command, a plain Python program inside the bpy wheel of this environment."""
    spec = importlib.util.find_spec("bpy")
    programs = sorted(Path(spec.origin).parent.glob(PROGRAM)) if spec and spec.origin else []
    if not programs:
        raise BuildError("this Python has no Blender; run: make zip")
    return programs[-1]


def _programs() -> list[Path]:
    """This environment's program and those of the others beside it: each Blender has rules of its own."""
    return sorted({_own_program(), *ROOT.glob(f".venv*/lib/python*/site-packages/bpy/{PROGRAM}")})


def _extension(program: Path, command: str, *arguments: str) -> None:
    done = subprocess.run(
        [sys.executable, "-I", str(program), command, *arguments], capture_output=True, text=True, check=False
    )
    if done.returncode:
        series = program.parents[4].name
        raise BuildError(f"'extension {command}' of Blender {series} failed:\n{done.stdout}{done.stderr}".rstrip())


def _write_reproducibly(source: Path, target: Path) -> None:
    """The same archive without the order of a folder, dates and permissions of this machine."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in sorted(old.namelist()):
            entry = zipfile.ZipInfo(name, DATE)
            entry.create_system = 3  # Unix, whatever builds it
            entry.external_attr = FILE_MODE
            entry.compress_type = old.getinfo(name).compress_type
            new.writestr(entry, old.read(name), compresslevel=9)


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


if __name__ == "__main__":
    sys.exit(main())
