# SPDX-License-Identifier: GPL-3.0-or-later
"""A real Blender on a virtual screen that waits for scenarios; started once for many tests, again after a crash."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
SERVER = Path(__file__).with_name("server.py")
START_SECONDS = 180.0  # of the first start: the machine may be busy, and nothing is in its caches
SCREEN = "1280x800"
LOG_TAIL_LINES = 60
# Blender 5.2 on Mesa's Vulkan keeps a mapping for each descriptor set, a hundred a redraw, and Linux gives a process
# 65530: one that has so many is ended before its next scenario.
MOST_MAPPINGS = 25_000


def full_blender() -> list[str]:
    """The command that runs things in the full Blender's folder, which it makes where it is missing."""
    script = ROOT / "scripts" / "full_blender"
    made = subprocess.run([script, "make"], capture_output=True, text=True, check=False)
    if made.returncode:
        pytest.fail(f"scripts/full_blender cannot make a Blender with a window:\n{made.stderr[-4000:]}")
    return [str(script), "--dir", made.stdout.strip().splitlines()[-1]]


def build_extension(command: list[str], folder: Path) -> Path:
    """The zip that users install on Linux: the one that GRIDLIGHT_ZIP names, else built now. Blender validates it."""
    named = os.environ.get("GRIDLIGHT_ZIP")
    if named:
        shutil.copy(named, folder)
    else:
        program = [sys.executable, "-I", str(ROOT / "scripts" / "build_zip.py"), "-o", str(folder)]
        done = subprocess.run(program, capture_output=True, text=True, check=False)
        if done.returncode:
            pytest.fail(f"the extension cannot be built:\n{done.stderr[-4000:]}")
    target = next(iter(folder.glob("*-linux_x64.zip")), None) or next(folder.glob("*.zip"))
    validate = ["shell", "blender", "--command", "extension", "validate", str(target)]
    done = subprocess.run([*command, *validate], capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.fail(f"Blender does not accept the zip:\n{done.stdout[-4000:]}{done.stderr[-4000:]}")
    return target


class BlenderSession:
    """One backend's Blender. ``run`` starts it where it is not running."""

    def __init__(self, command: list[str], backend: str, extension: Path, pictures: Path):
        self._command = command
        self._backend = backend
        self._extension = extension
        self._pictures = pictures
        self._process: subprocess.Popen | None = None
        self._folder: Path | None = None
        self._serial = 0
        self._mappings = 0  # of memory, after the last scenario
        self._broken = False  # starting failed: the next tests need not try again

    def run(self, file: str, name: str, arguments: list, timeout: float) -> None:
        """Runs scenario ``name`` of ``file`` and fails the test with what went wrong there."""
        if self._broken:
            pytest.fail(f"Blender ({self._backend}) cannot be started, see the first failure", pytrace=False)
        if self._process is None or self._process.poll() is not None or self._mappings > MOST_MAPPINGS:
            self._broken = True
            self._start()
            self._broken = False
        self._serial += 1
        said = len(self._log())
        task = self._folder / f"task{self._serial}.json"
        _write(task, {"file": file, "name": name, "arguments": arguments})
        answer = self._wait(self._folder / f"answer{self._serial}.json", timeout)
        self._mappings = answer["mappings"]
        if answer["failure"]:
            log = "\n".join(self._log()[said:][-LOG_TAIL_LINES:])
            pytest.fail(
                f"in Blender ({self._backend}):\n{answer['failure']}\npictures: {self._pictures}\nits words:\n{log}",
                pytrace=False,
            )

    def stop(self) -> None:
        """Ends Blender and its screen; the namespace that they live in takes everything with it."""
        if self._process is not None:
            if self._process.poll() is None:
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.wait()
            self._process = None
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None

    def _start(self) -> None:
        self.stop()
        self._serial = self._mappings = 0  # a new Blender begins to count anew
        self._folder = Path(tempfile.mkdtemp(prefix="gridlight-gui-"))
        self._pictures.mkdir(parents=True, exist_ok=True)
        environment = {
            **os.environ,
            "BLENDER_USER_RESOURCES": str(self._folder / "user"),
            "TMPDIR": str(self._folder),
            "GRIDLIGHT_PICTURES": str(self._pictures),
        }
        command = [*self._command, "run", "--backend", self._backend, "--size", SCREEN, "--factory-startup"]
        command += ["--python-exit-code", "1", "-P", str(SERVER)]
        command += ["--", "--gridlight-test-server", str(self._folder), str(self._extension)]
        with (self._folder / "blender.log").open("w") as log:
            self._process = subprocess.Popen(
                command, stdout=log, stderr=subprocess.STDOUT, env=environment, start_new_session=True
            )
        self._wait(self._folder / "ready.json", START_SECONDS)

    def _log(self) -> list[str]:
        return (self._folder / "blender.log").read_text(errors="replace").splitlines()

    def _wait(self, answer: Path, timeout: float) -> dict:
        deadline = time.monotonic() + timeout
        while not answer.exists():
            ended = self._process.poll() is not None
            if ended or time.monotonic() > deadline:
                what = f"ended with {self._process.returncode}" if ended else f"did not answer within {timeout:.0f} s"
                log = self._log()[-LOG_TAIL_LINES:]
                for crash in self._folder.glob("*.crash.txt"):  # where Blender was when it crashed
                    log += crash.read_text(errors="replace").splitlines()
                self.stop()
                pytest.fail(f"Blender ({self._backend}) {what}; its last words:\n" + "\n".join(log), pytrace=False)
            time.sleep(0.05)
        return json.loads(answer.read_text())


def _write(path: Path, value: dict) -> None:
    """Appears whole or not at all."""
    part = path.with_suffix(".part")
    part.write_text(json.dumps(value))
    part.replace(path)
