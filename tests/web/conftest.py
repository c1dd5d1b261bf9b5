# SPDX-License-Identifier: GPL-3.0-or-later
"""A browser, the packages of package.json and a server for the tests that run exports in the real three.js.

Chromium and npm are needed. Where one is missing the tests fail and say what installs it; they are never skipped.
"""

import contextlib
import http.server
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from functools import partial
from pathlib import Path

import pytest

HERE = Path(__file__).parent
PACKAGES = HERE / "node_modules"
sys.path[:0] = [str(HERE), str(HERE.parent / "export")]


def _tool(names, package: str) -> str:
    for name in names:
        if found := shutil.which(name):
            return found
    pytest.fail(f"{names[0]} is not here; install it: apt-get install -y {package}")


@pytest.fixture(scope="session")
def packages() -> Path:
    """The folder node_modules with what package-lock.json pins."""
    npm = _tool(["npm"], "npm")
    stamp = PACKAGES / ".package-lock.json"
    lock = HERE / "package-lock.json"
    if not stamp.is_file() or stamp.stat().st_mtime < lock.stat().st_mtime:
        command = [npm, "ci", "--no-audit", "--no-fund", "--ignore-scripts"]
        done = subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False, timeout=300)
        if done.returncode:
            pytest.fail(f"'{' '.join(command)}' in {HERE} failed; check the network\n{done.stderr[-2000:]}")
        stamp.touch()
    return PACKAGES


@pytest.fixture(scope="session")
def node():
    """Runs JavaScript in Node with the packages at hand; returns what it prints, as JSON."""
    program = _tool(["node", "nodejs"], "nodejs")

    def run(script: Path, *arguments):
        command = [program, script, *map(str, arguments)]
        done = subprocess.run(command, cwd=HERE, capture_output=True, text=True, check=False, timeout=120)
        assert done.returncode == 0, done.stderr[-3000:]
        return json.loads(done.stdout)

    return run


class _Handler(http.server.SimpleHTTPRequestHandler):
    """Serves a folder; takes one result; answers extra paths from ``extra``."""

    def __init__(self, *arguments, extra, results, **options):
        self._extra, self._results = extra, results
        super().__init__(*arguments, **options)

    def translate_path(self, path):
        name = path.split("?")[0].lstrip("/")
        if name.startswith("node_modules/"):
            return str(HERE / name)
        return str(self._extra[name]) if name in self._extra else super().translate_path(path)

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        self._results.append(json.loads(body))
        self.server.arrived.set()

    def log_message(self, *_):
        pass


@pytest.fixture(scope="session")
def browse(packages):
    """Opens a page of a folder in headless Chromium.

    Called with the folder, the page and extra files by name, it returns what the page posts to /result; with
    ``screenshot``, a path, it saves a picture of the page instead.
    """
    chromium = _tool(["chromium", "chromium-headless-shell", "google-chrome"], "chromium")

    def open_page(folder, page, extra=None, screenshot=None):
        results = []
        handler = partial(_Handler, directory=str(folder), extra=extra or {}, results=results)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
        server.arrived = threading.Event()
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with tempfile.TemporaryDirectory(prefix="gridlight-browser-") as profile:
            command = [
                chromium,
                "--headless",
                "--no-sandbox",  # CI runs as root
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--disable-dev-shm-usage",
                f"--user-data-dir={profile}",
                f"http://127.0.0.1:{server.server_port}/{page}",
            ]
            if screenshot:
                options = [f"--screenshot={screenshot}", "--window-size=1280,720", "--virtual-time-budget=30000"]
                command[1:1] = options
            log = tempfile.TemporaryFile(dir=profile)
            process = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
            try:
                if screenshot:
                    process.wait(timeout=120)
                else:
                    server.arrived.wait(timeout=120)
            finally:
                with contextlib.suppress(ProcessLookupError):  # it ended by itself, its children with it
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
                server.shutdown()
                server.server_close()
            log.seek(0)
            chatter = log.read().decode("utf-8", "replace")
        if screenshot:
            assert Path(screenshot).is_file(), chatter[-3000:]
            return None
        assert results, f"the page sent nothing within two minutes\n{chatter[-3000:]}"
        assert "error" not in results[0], results[0]["error"]
        return results[0]

    return open_page
