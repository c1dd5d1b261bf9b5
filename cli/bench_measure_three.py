# SPDX-License-Identifier: GPL-3.0-or-later
"""three.js's own bake of a probe grid, in headless Chromium on the same scene as GLB, for ``bench pareto``.

Its lamps are what the export for three.js makes of the scene's. It has no area lights with shadows: a spot of the same
power stands in for one. Its field is read through white cards, as its shader would light them.
"""

from __future__ import annotations

import json
import math
import shutil
import tempfile
from pathlib import Path

import numpy as np

from ..core import user_cache
from ..core.errors import InputError
from ..formats.export_lattice import axes_matrix, cell_box
from ..formats.export_three_scene import describe
from ..scene.gltf_export import export_glb
from ..scene.read import read_scene
from . import bench_scenes, headless_browser
from .bench_measure import report
from .bench_measure_peers import load_scene
from .verify_points import SIX_NORMALS

_PAGE = Path(__file__).parent / "bench_three"
_VIEWER = Path(__file__).parent.parent / "formats" / "three_viewer"


def three(request: dict, reporter, _should_stop) -> None:
    """Bakes with ``request["settings"]`` (options of three.js's ``bake``) and reports a row for each."""
    headless_browser.tool(headless_browser.CHROMIUM, "chromium")
    packages = _packages()
    scene = load_scene(request, reporter)
    snapshot = read_scene(scene)
    grid = bench_scenes.grid_of(request["scene"], snapshot)
    box = cell_box(grid)
    if not np.allclose(box[:3, :3], np.diag(np.diag(box[:3, :3]))):
        raise InputError("three.js's grids stand along the axes, and this volume is turned")
    axes = axes_matrix("y-up")
    with tempfile.TemporaryDirectory(prefix="gridlight-three-") as name:
        folder = Path(name)
        reporter.phase("export")
        export_glb(folder / "scene.glb")
        about = describe(snapshot, axes, "scene.glb")
        about["lamps"] = [_of_same_power(lamp) for lamp in about["lamps"]]
        _write(folder / "scene.json", about)
        _write(
            folder / "request.json",
            {
                "size": np.abs(axes @ (2 * np.diag(box)[:3])).tolist(),
                "resolution": np.abs(axes @ grid.resolution).astype(int).tolist(),
                "center": (axes @ grid.center).tolist(),
                "nodes": (np.array(request["nodes"]) @ axes.T).tolist(),
                "normals": (SIX_NORMALS @ axes.T).tolist(),
                "settings": request["settings"],
                "seconds": 0.7 * request["seconds"],
            },
        )
        files = {item.name: item for folder_ in (_VIEWER, _PAGE) for item in folder_.iterdir() if item.is_file()}
        reporter.phase("three.js in Chromium")
        result = headless_browser.open_page(
            folder,
            "index.html",
            packages,
            {name: path for name, path in files.items() if name.endswith((".js", ".html"))},
            limit_s=request["seconds"],
            graphics=headless_browser.SOFTWARE if request["software"] else headless_browser.HARDWARE,
        )
    report({"three": {"revision": result["revision"], "device": result["device"]}})
    for run in result["runs"]:
        cold, warm = run["seconds"][0], run["seconds"][-1]
        report(
            {
                "run": "warm" if len(run["seconds"]) > 1 else "first",
                "seconds": warm,
                "measured": grid.count,
                "phases": {"first bake": cold, "bake": warm},
                "options": run["options"],
                "irradiance": run["irradiance"],
            }
        )
    reporter.finish()


def _of_same_power(lamp: dict) -> dict:
    """``lamp``; where it is a spot that stands in for a flat one, as bright as sends out the same power.

    A flat lamp falls off as the cosine c, whose mean over the half sphere is 1/2. three.js's spot with full blend falls
    off as smoothstep(cos angle, 1, c), whose mean is (1 − cos angle) / 2.
    """
    if lamp.get("stands_in_for") != "area":
        return lamp
    share = 1.0 - math.cos(lamp["angle"])
    return {**lamp, "color": [value / share for value in lamp["color"]]}


def _write(path: Path, value: dict) -> None:
    path.write_text(json.dumps(value), encoding="utf-8")


def _packages() -> Path:
    """node_modules with three.js, kept in the user's cache folder."""
    try:
        folder = user_cache.folder() / "three"
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json"):
            content = (_PAGE / name).read_bytes()
            if not (folder / name).is_file() or (folder / name).read_bytes() != content:
                shutil.copy(_PAGE / name, folder / name)
    except OSError as error:
        raise InputError(f"three.js has no place: {error}; name a folder with GRIDLIGHT_CACHE") from None
    return headless_browser.install_packages(folder)
