# SPDX-License-Identifier: GPL-3.0-or-later
"""Pages in headless Chromium that post one result back, with npm packages at hand.

For the peer that runs in a browser (``bench pareto``) and for tests of exports. Standard library only.
"""

from __future__ import annotations

import contextlib
import http.server
import json
import os
import shutil
import signal
import subprocess
import tempfile
import threading
from functools import partial
from pathlib import Path

from ..core.errors import InputError

SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
HARDWARE = ("--use-angle=gl-egl", "--ignore-gpu-blocklist")
CHROMIUM = ("chromium", "chromium-headless-shell", "google-chrome")


def tool(names: tuple[str, ...], package: str) -> str:
    """Path of the first program of ``names`` that is there.

    Raises:
        InputError: none is; the message says what installs it.
    """
    for name in names:
        if found := shutil.which(name):
            return found
    raise InputError(f"{names[0]} is not here; install it: apt-get install -y {package}")


def install_packages(folder: Path, limit_s: float = 300.0) -> Path:
    """The folder node_modules with what package-lock.json in ``folder`` pins.

    Raises:
        InputError: npm is missing or fails.
    """
    npm = tool(("npm",), "npm")
    lock, stamp = folder / "package-lock.json", folder / "node_modules" / ".package-lock.json"
    if not stamp.is_file() or stamp.stat().st_mtime < lock.stat().st_mtime:
        command = [npm, "ci", "--no-audit", "--no-fund", "--ignore-scripts"]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=limit_s)
        except subprocess.TimeoutExpired:
            slow = f"'{' '.join(command)}' in {folder} took more than {limit_s:g} s; check the network"
            raise InputError(slow) from None
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:]
            raise InputError(f"'{' '.join(command)}' in {folder} failed; check the network: {' '.join(last)}")
        stamp.touch()
    return stamp.parent


class _Server(http.server.ThreadingHTTPServer):
    """``arrived`` is set when the page has posted its result."""

    def __init__(self, handler):
        super().__init__(("127.0.0.1", 0), handler)
        self.arrived = threading.Event()


class _Handler(http.server.SimpleHTTPRequestHandler):
    """Serves a folder and the packages; takes one result; answers extra paths from ``extra``."""

    def __init__(self, *arguments, extra, packages, results, **options):
        self._extra, self._packages, self._results = extra, packages, results
        super().__init__(*arguments, **options)

    def translate_path(self, path):
        name = path.split("?")[0].lstrip("/")
        if name.startswith("node_modules/"):
            return str(self._packages.parent / name)
        return str(self._extra[name]) if name in self._extra else super().translate_path(path)

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        self._results.append(json.loads(body))
        if isinstance(self.server, _Server):
            self.server.arrived.set()

    def log_message(self, *_):
        pass


def open_page(
    folder: Path,
    page: str,
    packages: Path,
    extra: dict[str, Path] | None = None,
    limit_s: float = 120.0,
    screenshot: Path | None = None,
    graphics: tuple[str, ...] = SOFTWARE,
) -> dict | None:
    """Opens ``page`` of ``folder``, with ``extra`` files by name, and returns what it posts to /result.

    With ``screenshot`` it saves a picture of the page there instead and returns None.

    Raises:
        InputError: Chromium is missing, the page sends nothing within ``limit_s``, or what it sends has an "error".
    """
    chromium = tool(CHROMIUM, "chromium")
    results: list[dict] = []
    handler = partial(_Handler, directory=str(folder), extra=extra or {}, packages=packages, results=results)
    server = _Server(handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with tempfile.TemporaryDirectory(prefix="gridlight-browser-", ignore_cleanup_errors=True) as profile:
        command = [
            chromium,
            "--headless",
            "--no-sandbox",  # CI runs as root
            *graphics,
            "--disable-dev-shm-usage",
            f"--user-data-dir={profile}",
            f"http://127.0.0.1:{server.server_port}/{page}",
        ]
        if screenshot:
            command[1:1] = [f"--screenshot={screenshot}", "--window-size=1280,720", "--virtual-time-budget=30000"]
        log = tempfile.TemporaryFile(dir=profile)
        process = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
        try:
            if screenshot:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(timeout=limit_s)
            else:
                server.arrived.wait(timeout=limit_s)
        finally:
            with contextlib.suppress(ProcessLookupError):  # it ended by itself, its children with it
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            server.shutdown()
            server.server_close()
        log.seek(0)
        chatter = log.read().decode("utf-8", "replace").strip()[-1500:]
    if screenshot:
        if not Path(screenshot).is_file():
            raise InputError(f"Chromium took no picture of {page}: {chatter}")
        return None
    if not results:
        raise InputError(f"{page} sent nothing within {limit_s:g} s: {chatter}")
    if "error" in results[0]:
        raise InputError(f"{page}: {results[0]['error']}")
    return results[0]
