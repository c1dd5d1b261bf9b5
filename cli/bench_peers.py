# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bench peers``: which peers are measured with what, in which order, and how their errors are found."""

from __future__ import annotations

import tempfile

import numpy as np

from ..core import measures
from ..core.errors import InputError
from . import bench_peers_plot, bench_peers_table
from .bench_run import Run

GALLERY = "gallery"  # a name of bench_scenes, which only processes with Blender can import
# (width, height, samples) of the Cycles panoramas. The first is the cheapest that is accurate.
CYCLES_SETTINGS = ((64, 32, 8), (32, 16, 8), (128, 64, 8))


def measure(run: Run) -> dict:
    """Facts of the summary: scene, our bake, rows, reference.

    Raises:
        InputError: our own bake could not be measured, without which the others have nothing to be compared with.
    """
    args, settings = run.args, run.settings
    peers = Peers(run)
    request = {
        "peer": "gridlight",
        "scene": GALLERY,
        "settings": run.settings_dict,
        "nodes": args.error_nodes if args.error else 0,
    }
    setting = differences(settings) or "default"
    with tempfile.TemporaryDirectory(prefix="gridlight-shaders-") as cache:
        ours, own_rows = peers.measure({**request, "shader_cache": cache}, "Gridlight", setting)
        if not {"scene", "device"} <= set(ours) or "problem" in own_rows[-1]:
            raise InputError(
                f"our own bake could not be measured: {own_rows[-1].get('problem') or 'its process said nothing'}"
            )
        reference = _others(peers, run, ours.get("nodes", []))
        peers.measure({**request, "shader_cache": cache, "only": "first"}, "Gridlight", setting)
    warm_s = next(row["seconds"] for row in own_rows if row["run"] == "warm")
    peers.relate(ours["scene"]["locations"], warm_s)
    return {
        "blender": ours["blender"],
        "device": ours["device"],
        "scene": ours["scene"],
        "bake": {**ours["bake"], "settings": settings.as_dict()},
        "rows": peers.rows,
        "reference": reference,
        "status": ours["status"],
    }


def _others(peers: Peers, run: Run, nodes: list) -> dict | None:
    """Measures who else bakes the gallery. Returns what errors at ``nodes`` are held against; None without nodes."""
    args, bands = run.args, run.settings.bands
    reference = peers.errors(GALLERY, nodes, args.error_spp, bands) if nodes else None
    for panorama in CYCLES_SETTINGS:
        request = cycles_request(GALLERY, panorama, args.panoramas, nodes, bands)
        peers.measure(request, "Cycles panoramas", panorama_name(panorama))
    if not args.no_eevee:
        request = {"peer": "eevee", "scene": GALLERY, "samples": args.eevee_samples, "nodes": nodes}
        peers.measure(request, "EEVEE volume", f"{args.eevee_samples} samples")
    return reference


table = bench_peers_table.table
plot = bench_peers_plot.plot


def cycles_request(scene: str, panorama, count: int | None, nodes: list, bands: int) -> dict:
    """``panorama``: (width, height, samples); ``count`` locations are measured and scaled, None: all."""
    return {
        "peer": "cycles",
        "scene": scene,
        "panorama": list(panorama),
        "panoramas": count,
        "nodes": nodes,
        "bands": bands,
    }


def panorama_name(panorama) -> str:
    width, height, samples = panorama
    return f"{width}×{height}, {samples} samples"


def not_measured(problem: str) -> dict:
    """The row of what ended early."""
    return {"run": "", "seconds": None, "measured": 0, "phases": {}, "problem": problem}


class Peers:
    """Collects rows, and per row the irradiance that its error is computed from."""

    def __init__(self, run: Run):
        self._run = run
        self.rows: list[dict] = []
        self._irradiance: list[np.ndarray | None] = []  # (N, 6, 3) per row
        self._truth: np.ndarray | None = None

    def measure(self, request: dict, name: str, setting: str) -> tuple[dict, list[dict]]:
        """Measures one peer and adds its rows, one without a time where it ended early.

        Returns (its reports merged, its rows).
        """
        merged, runs, _ = self._run.child(request, f"{name}, {setting}", optional=True)
        if "problem" in merged:
            runs = [*runs, not_measured(merged["problem"])]
        irradiance = np.array(merged["irradiance"]) if "irradiance" in merged else None
        return merged, [self.add(name, setting, run, irradiance) for run in runs]

    def add(self, name: str, setting: str, run: dict, irradiance: np.ndarray | None) -> dict:
        """Adds one row as a child reported it."""
        empty = {"probes_per_second": None, "ratio_to_warm": None, "error": None}
        row = {"peer": name, "setting": setting, **empty, **run}
        self.rows.append(row)
        self._irradiance.append(irradiance)
        self._find_error(row, irradiance)
        return row

    def _find_error(self, row: dict, irradiance: np.ndarray | None) -> None:
        if self._truth is not None and irradiance is not None and row["seconds"] is not None:
            row["error"] = measures.compare(irradiance, self._truth).as_dict()

    def relate(self, locations: int, warm_s: float) -> None:
        """Fills in the figures that follow from times."""
        for row in self.rows:
            if row["seconds"] is not None:
                row["probes_per_second"] = locations / row["seconds"]
                row["ratio_to_warm"] = row["seconds"] / warm_s

    def errors(self, scene: str, nodes: list, samples: int, bands: int) -> dict | None:
        """Renders the truth, with which rows get their "error" from now on and those that are there get it now.

        Returns the reference's own figures, or None where it failed.
        """
        request = {"peer": "reference", "scene": scene, "nodes": nodes, "samples": samples, "bands": bands}
        merged, _, _ = self._run.child(request, f"reference at {len(nodes)} nodes", optional=True)
        if "series" not in merged:
            self._run.reporter.warn("no errors: the reference could not be rendered")
            return None
        series = np.array(merged["series"])
        truth = self._truth = series.mean(axis=0)
        for row, irradiance in zip(self.rows, self._irradiance):
            self._find_error(row, irradiance)
        return {
            "engine": "Cycles",
            "width": 128,
            "height": 64,
            "samples": samples,
            "seeds": len(series),
            "nodes": len(nodes),
            "noise": measures.noise_of_mean(*series),
            "floor": measures.compare(np.array(merged["floor"]), truth).as_dict(),
            "bands": bands,
        }


def differences(settings) -> str:
    """The settings that are not the default, as text."""
    standard, chosen = type(settings)().as_dict(), settings.as_dict()
    return ", ".join(f"{name} {value}" for name, value in chosen.items() if value != standard[name])
