# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bench scaling``: how a bake's cost grows with probes, triangles, texels and lamps, phase by phase."""

from __future__ import annotations

import math

import numpy as np

from . import bench_chart, bench_table
from .bench_run import Run

BASE = {"probes": 300, "triangles": 10_000, "face": 16, "lamps": 2}
_PROBES = [30, 100, 300, 1000, 3000, 10_000, 30_000]
_TRIANGLES = [1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000]
_FACES = [8, 12, 16, 24, 32, 48, 64]
_LAMPS = [2, 5, 16, 50, 150, 500, 1500]
SWEEPS = (
    {"name": "triangles", "parameter": "triangles", "capture": "trace", "sizes": _TRIANGLES},
    {"name": "probes", "parameter": "probes", "capture": "trace", "sizes": _PROBES},
    {"name": "faces", "parameter": "face", "capture": "trace", "sizes": _FACES},
    {"name": "lamps", "parameter": "lamps", "capture": "trace", "sizes": _LAMPS},
    {"name": "triangles, rasterised", "parameter": "triangles", "capture": "raster", "sizes": _TRIANGLES},
    {"name": "probes, rasterised", "parameter": "probes", "capture": "raster", "sizes": _PROBES},
    {"name": "faces, rasterised", "parameter": "face", "capture": "raster", "sizes": _FACES},
)


def measure(run: Run) -> dict:
    """Facts of the summary: sweeps with their rows and exponents."""
    # The child stops by itself in time for its last report; the limit of the process is for one that hangs.
    request = {
        "peer": "scaling",
        "seconds": 0.9 * run.limit_s,
        "base": BASE,
        "settings": run.settings_dict,
        "sweeps": SWEEPS,
    }
    merged, rows, reports = run.child(request, "our bake")
    left_out = [report["left_out"] for report in reports if "left_out" in report]
    sweeps = []
    for sweep in SWEEPS:
        mine = [row for row in rows if row["run"] == sweep["name"]]
        sweeps.append(
            {
                **{key: sweep[key] for key in ("name", "parameter", "capture")},
                "rows": mine,
                "exponents": exponents(mine),
                "left_out": next((item for item in left_out if item["sweep"] == sweep["name"]), None),
            }
        )
    return {
        "device": merged["device"],
        "blender": merged["blender"],
        "base": BASE,
        "cold": {
            "context_seconds": merged["context_seconds"],
            "trial_seconds": merged["trial_seconds"],
            "variants": [report["cold"] for report in reports if "cold" in report],
        },
        "crossover_triangles": crossover(*(_rows_of(sweeps, name) for name in ("triangles, rasterised", "triangles"))),
        "sweeps": sweeps,
        "problem": merged.get("problem"),
    }


def _rows_of(sweeps: list[dict], name: str) -> list[dict]:
    return next(sweep["rows"] for sweep in sweeps if sweep["name"] == name)


def crossover(rasterised: list[dict], traced: list[dict]) -> float | None:
    """Triangles at which both captures took the same time, between two sizes that both measured; None where they never
    did."""
    by_size = {row["size"]: row for row in traced}
    pairs = [(row, by_size[row["size"]]) for row in rasterised if row["size"] in by_size]
    lead = [np.log(raster["capture_again"] / trace["capture_again"]) for raster, trace in pairs]
    for index in range(1, len(pairs)):
        if lead[index - 1] <= 0 < lead[index]:
            share = lead[index - 1] / (lead[index - 1] - lead[index])
            low, high = (np.log(pairs[at][0]["triangles"]) for at in (index - 1, index))
            return float(np.exp(low + share * (high - low)))
    return None


_PER_SCENE = ("read", "hierarchy, upload", "culling, placement", "capture")  # with the first capture the scene is sent


def growth(rows: list[dict]) -> dict[str, float] | None:
    """By how much what a probe adds to a bake grows from 10 000 triangles to the most: its capture when the scene is
    there, and that with its patches, their light and its field. None where the range was not measured."""
    middle = [row for row in rows if row["size"] == BASE["triangles"]]
    if not middle or rows[-1]["size"] <= BASE["triangles"]:
        return None
    first, last = middle[0], rows[-1]

    def per_probe(row: dict) -> float:
        others = sum(seconds for name, seconds in row["phases"].items() if name not in _PER_SCENE)
        return (row["capture_again"] + others) / row["probes"]

    return {
        "to": last["triangles"],
        "capture": last["capture_again"] / first["capture_again"],
        "bake": per_probe(last) / per_probe(first),
    }


def exponents(rows: list[dict]) -> dict[str, float]:
    """Slope of log seconds over log size by least squares, for every phase and the whole; empty below three sizes."""
    if len(rows) < 3:
        return {}
    sizes = np.log([row["size"] for row in rows])
    found = {}
    for name in [*phases_of(rows), "whole"]:
        seconds = [row["seconds"] if name == "whole" else row["phases"].get(name, 0.0) for row in rows]
        if min(seconds) > 0:
            found[name] = float(np.polyfit(sizes, np.log(seconds), 1)[0])
    return found


def phases_of(rows: list[dict]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row["phases"]))


def table(summary: dict) -> list[str]:
    lines = ["Seconds, warm, median of up to five; the GPU is waited for after every phase. Every probe is kept."]
    base = summary["base"]
    lines.append(
        f"What is not varied: {base['probes']} probes, {base['triangles']} triangles, faces of {base['face']}² texels, "
        f"{base['lamps']} lamps; a hall whose walls and balls are cut finer, or lit by small lamps."
    )
    lines.append("Exponent: of growth with the size, fitted to all sizes; 1 is in proportion.")
    cold = summary["cold"]
    lines.append(
        f"Cold: GPU context {bench_table.significant(cold['context_seconds'])} s, trial captures "
        f"{bench_table.significant(cold['trial_seconds'])} s where they are not kept; first bake of 30 probes and 1000 "
        "triangles, which compiles shaders: "
        + ", ".join(
            f"{item['capture']}, face {item['face']}: {bench_table.significant(item['seconds'])}"
            for item in cold["variants"]
        )
    )
    for sweep in summary["sweeps"]:
        lines += ["", *_sweep_table(sweep)]
    both = summary["crossover_triangles"]
    lines += [
        "",
        f"Both captures cost the same at {'no size in both sweeps' if both is None else f'{both:.0f} triangles'}.",
    ]
    if summary["problem"]:
        lines += ["", f"ended early: {summary['problem']}"]
    return lines


def _sweep_table(sweep: dict) -> list[str]:
    rows = sweep["rows"]
    lines = [f"{sweep['name']} ({sweep['capture']})"]
    if rows:
        names = phases_of(rows)
        cells = [[sweep["parameter"], "patches", *names, "whole", "µs/probe", "capture again", "predicted"]]
        for row in rows:
            size = row[sweep["parameter"]]
            seconds = [row["phases"].get(name, 0.0) for name in names]
            cells.append(
                [
                    f"{size}{'' if row['resident'] else '*'}",
                    str(row["patches"]),
                    *[bench_table.significant(value) for value in [*seconds, row["seconds"]]],
                    bench_table.significant(1e6 * row["seconds"] / row["probes"]),
                    bench_table.significant(row["capture_again"]),
                    bench_table.significant(row["predicted_capture"]),
                ]
            )
        if sweep["exponents"]:
            fitted = [sweep["exponents"].get(name, math.nan) for name in [*names, "whole"]]
            cells.append(["exponent", "", *["–" if math.isnan(v) else f"{v:.2f}" for v in fitted]])
        lines += bench_table.columns(cells)
    if not all(row["resident"] for row in rows):
        lines.append("* more than the memory budget holds: captured again whenever texels are needed")
    grown = growth(rows) if sweep["parameter"] == "triangles" else None
    if grown:
        lines.append(
            f"from {BASE['triangles']} to {grown['to']} triangles a probe's capture, the scene being there, grows "
            f"{grown['capture']:.2f} times, with its patches, their light and its field {grown['bake']:.2f} times"
        )
    if sweep["left_out"]:
        item = sweep["left_out"]
        why = item.get("reason") or f"about {bench_table.significant(item['expected_seconds'])} s more than is left"
        lines.append(f"from {item['from']} on left out: {why}")
    return lines


def plot(summary: dict) -> str:
    """Seconds over size, a line a sweep: whole bakes and captures alone."""
    panels = []
    for parameter in ("triangles", "probes", "face", "lamps"):
        chart = bench_chart.Chart(f"{parameter}", parameter, "seconds")
        for sweep in summary["sweeps"]:
            if sweep["parameter"] != parameter or not sweep["rows"]:
                continue
            sizes = [row[parameter] for row in sweep["rows"]]
            chart.line(f"{sweep['capture']}, whole", sizes, [row["seconds"] for row in sweep["rows"]])
            captured = [row["capture_again"] for row in sweep["rows"]]
            chart.line(f"{sweep['capture']}, capture", sizes, captured, dashed=True)
        panels.append(chart)
    return bench_chart.page("Cost of a bake over its size", summary, panels)
