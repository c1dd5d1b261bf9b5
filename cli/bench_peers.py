# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bench peers``: which peers are measured with what, in which order, and what becomes of their reports."""

from __future__ import annotations

import json
import os
import platform
import shlex
import sys
import time
from pathlib import Path

import numpy as np

from ..core import measures
from ..core.errors import InputError, NoGpuError
from ..formats.probe_metadata import program_version
from . import bake, bench_plot, bench_process, bench_table, system_libraries

# (width, height, samples) of the Cycles panoramas. The first is the cheapest that is accurate.
CYCLES_SETTINGS = ((64, 32, 8), (32, 16, 8), (128, 64, 8))


def run(args, reporter, folder) -> tuple[dict, int]:
    """Measures all peers. Returns (summary, exit status of our own bake); stages files in ``folder`` unless it is None.

    Raises:
        InputError: our own bake could not be measured, without which the others have nothing to be compared with.
        NoGpuError: there is no driver that could make a GPU context.
    """
    problem = None if args.in_blender else system_libraries.ensure(reporter.note)
    if problem:
        raise NoGpuError(problem)
    started = time.perf_counter()
    machine = _machine()
    bench = _Bench(args, reporter)
    settings = bake.settings_from(args)
    request = {"peer": "gridlight", "settings": vars(settings), "nodes": args.error_nodes if args.error else 0}
    ours, own_rows = bench.peer(request, "Gridlight", _differences(settings) or "default")
    if not {"scene", "device"} <= set(ours) or "problem" in own_rows[-1]:
        raise InputError(
            f"our own bake could not be measured: {own_rows[-1].get('problem') or 'its process said nothing'}"
        )
    nodes = ours.get("nodes", [])
    for width, height, samples in CYCLES_SETTINGS:
        request = {
            "peer": "cycles",
            "panorama": [width, height, samples],
            "panoramas": args.panoramas,
            "nodes": nodes,
            "bands": settings.bands,
        }
        bench.peer(request, "Cycles panoramas", f"{width}×{height}, {samples} samples")
    if not args.no_eevee:
        bench.peer({"peer": "eevee", "samples": args.eevee_samples}, "EEVEE volume", f"{args.eevee_samples} samples")
    locations = ours["scene"]["locations"]
    warm_s = next(row["seconds"] for row in own_rows if row["run"] == "warm")
    for row in bench.rows:
        if row["seconds"] is not None:
            row["probes_per_second"] = locations / row["seconds"]
            row["ratio_to_warm"] = row["seconds"] / warm_s
    summary = {
        "bench": args.name,
        "command": _command(),
        "version": program_version(),
        "blender": ours["blender"],
        "device": ours["device"],
        "machine": machine,
        "scene": ours["scene"],
        "bake": {**ours["bake"], "settings": settings.as_dict()},
        "rows": bench.rows,
        "reference": bench.errors(nodes, args.error_spp, settings.bands) if nodes else None,
        "seconds": {"total": round(time.perf_counter() - started, 6)},
        "files": [],
        "warnings": reporter.warnings,
    }
    text = bench_table.table(summary)
    reporter.result(text)
    if folder is not None:
        summary["files"] = [str(folder.folder / f"peers.{kind}") for kind in ("txt", "json", "svg")]
        folder.path("peers.txt").write_text(text + "\n", encoding="utf-8")
        folder.path("peers.json").write_text(json.dumps(summary, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        folder.path("peers.svg").write_text(bench_plot.plot(summary), encoding="utf-8")
    return summary, ours["status"]


class _Bench:
    """Collects rows, and per row the irradiance that its error is computed from."""

    def __init__(self, args, reporter):
        self._args = args
        self._reporter = reporter
        self.rows: list[dict] = []
        self._irradiance: list[np.ndarray | None] = []  # (N, 6, 3) per row

    def child(self, request: dict) -> tuple[dict, list[dict]]:
        """Runs one measurement. Returns (its reports merged, "problem" where it ended early; those that are rows)."""
        args = self._args
        options = ["--quiet"] if args.quiet else []
        reports, problem = bench_process.measure_in_child(request, args.limit, options, args.in_blender, args.verbose)
        merged = {}
        for report in reports:
            if "run" not in report:
                merged.update(report)
        for warning in merged.get("warnings", []):  # the child has shown them already
            if warning not in self._reporter.warnings:
                self._reporter.warnings.append(warning)
        if problem:
            merged["problem"] = problem
        return merged, [report for report in reports if "run" in report]

    def peer(self, request: dict, name: str, setting: str) -> tuple[dict, list[dict]]:
        """Measures one peer and adds its rows, one without a time where it ended early.

        Returns (its reports merged, its rows).
        """
        self._reporter.note(f"{name}, {setting}")
        merged, runs = self.child(request)
        if "problem" in merged:
            self._reporter.warn(f"{name}, {setting}: {merged['problem']}")
            runs = [*runs, {"run": "", "seconds": None, "measured": 0, "phases": {}, "problem": merged["problem"]}]
        irradiance = np.array(merged["irradiance"]) if "irradiance" in merged else None
        rows = [
            {"peer": name, "setting": setting, "probes_per_second": None, "ratio_to_warm": None, "error": None, **run}
            for run in runs
        ]
        self.rows += rows
        self._irradiance += [irradiance] * len(rows)
        return merged, rows

    def errors(self, nodes: list, samples: int, bands: int) -> dict | None:
        """Fills "error" of the rows whose irradiance is known. Returns the reference's own figures, or None."""
        self._reporter.note(f"reference at {len(nodes)} nodes")
        merged, _ = self.child({"peer": "reference", "nodes": nodes, "samples": samples, "bands": bands})
        if "series" not in merged:
            self._reporter.warn(f"no errors: the reference could not be rendered: {merged['problem']}")
            return None
        series = np.array(merged["series"])
        truth = series.mean(axis=0)
        for row, irradiance in zip(self.rows, self._irradiance):
            if irradiance is not None and row["seconds"] is not None:
                row["error"] = measures.compare(irradiance, truth).as_dict()
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


def _differences(settings) -> str:
    """The settings that are not the default, as text."""
    standard, chosen = type(settings)().as_dict(), settings.as_dict()
    return ", ".join(f"{name} {value}" for name, value in chosen.items() if value != standard[name])


def _machine() -> dict:
    """What the times depend on besides the GPU; the load tells whether others were at work when the bench began."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "processor": _processor(),
        "cores": cores,
        "load_before": load,
        "system": f"{platform.system()} {platform.machine()}",
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:  # not Linux
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _command() -> str:
    """The command line that was given, without what starts it."""
    words = sys.argv[sys.argv.index("bench") :] if "bench" in sys.argv else ["bench"]
    return f"./gridlight {shlex.join(words)}"
