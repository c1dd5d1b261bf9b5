# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender (``blender -P server.py -- --gridlight-test-server FOLDER EXTENSION.zip``): waits for scenarios.

Installs the extension, says that it is ready, then takes ``task<N>.json`` files from FOLDER one by one, runs the
scenario that each names, from a timer so that Blender lives on, and answers with ``answer<N>.json``.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
import traceback
from pathlib import Path

import addon_utils
import bpy

sys.path.insert(0, str(Path(__file__).parent))

from person import EXTENSION, Person

POLL_SECONDS = 0.05
FIRST_SECONDS = 1.5  # a window that has just appeared takes no notice of clicks
SETTLE_SECONDS = 0.3  # after loading a file: time for its windows to be drawn

_is_fresh = False  # whether the scenario before ended well and left a file as Blender starts with
_unseen: list[str] = []  # exceptions in handlers, timers and panels: Blender prints them and goes on


def _note_exception(kind, error, trace) -> None:
    _unseen.append("".join(traceback.format_exception(kind, error, trace)))
    sys.__excepthook__(kind, error, trace)


class Server:
    """Drives one scenario at a time."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._serial = 0
        self._scenario = None

    def __call__(self) -> float:
        """The timer: one step of the running scenario, or a look for the next."""
        if self._scenario is None:
            task = self._folder / f"task{self._serial + 1}.json"
            if not task.exists():
                return POLL_SECONDS
            self._serial += 1
            self._scenario = _scenario(**json.loads(task.read_text()))
        failure = ""
        try:
            return max(float(next(self._scenario)), 0.0)
        except StopIteration:
            pass
        except Exception:  # whatever a scenario raises is its failure and goes to pytest
            failure = traceback.format_exc()
        self._scenario = None
        mappings = len(Path("/proc/self/maps").read_text().splitlines())
        _write(self._folder / f"answer{self._serial}.json", {"failure": failure, "mappings": mappings})
        return POLL_SECONDS


def _scenario(file: str, name: str, arguments: list):
    """A fresh file, the scenario, and what must hold after each."""
    global _is_fresh
    addon_utils.enable(EXTENSION)  # a scenario may have failed with the extension switched off
    if not _is_fresh:
        yield from _load_fresh()
    _is_fresh = False
    spec = importlib.util.spec_from_file_location(Path(file).stem, file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    person = Person("-".join([name, *map(str, arguments)]))
    _unseen.clear()
    try:
        yield from getattr(module, name)(person, *arguments)
    except Exception:
        person.picture("failure")
        raise
    yield SETTLE_SECONDS
    yield from person.check_nothing_runs()
    yield from _load_fresh()
    _is_fresh = True
    person.check_nothing_is_held()
    assert not _unseen, "\n".join(_unseen)


def _load_fresh():
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield SETTLE_SECONDS


def _check_nothing_is_of_the_checkout() -> None:
    """What is tested is the installed zip, whole: nothing of it may come from where these tests lie."""
    checkout = Path(__file__).resolve().parents[2]
    user = Path(os.environ["BLENDER_USER_RESOURCES"]).resolve()
    for name, module in list(sys.modules.items()):
        if name.startswith(EXTENSION) and not Path(module.__file__).resolve().is_relative_to(user):
            raise RuntimeError(f"{name} is {module.__file__}, not of the installed extension")
    on_path = [path for path in map(Path, filter(None, sys.path)) if path.resolve() in (checkout, checkout.parent)]
    if on_path:
        raise RuntimeError(f"modules are also looked for in {on_path}")


def _write(path: Path, value: dict) -> None:
    part = path.with_suffix(".part")
    part.write_text(json.dumps(value))
    part.replace(path)


def _start() -> None:
    folder, extension = sys.argv[sys.argv.index("--gridlight-test-server") + 1 :]
    sys.excepthook = _note_exception
    preferences = bpy.context.preferences
    preferences.view.show_splash = False
    preferences.view.ui_scale = 1.0
    preferences.use_preferences_save = False
    bpy.ops.extensions.package_install_files(filepath=extension, repo="user_default", enable_on_install=True)
    if EXTENSION not in preferences.addons:
        raise RuntimeError(f"{extension} did not install as {EXTENSION}")
    _check_nothing_is_of_the_checkout()
    bpy.app.timers.register(Server(Path(folder)), first_interval=FIRST_SECONDS, persistent=True)
    _write(Path(folder) / "ready.json", {})


_start()
