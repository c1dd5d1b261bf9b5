# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bench frame``: what a frame costs while a light moves, and where that time goes."""

from __future__ import annotations

from . import bench_chart, bench_table
from .bench_run import Run

_MOVES = 120


def measure(run: Run) -> dict:
    """Facts of the summary."""
    request = {
        "peer": "frame",
        "scene": "gallery",
        "settings": run.settings_dict,
        "moves": _MOVES,
        "seconds": 0.8 * run.limit_s,
    }
    merged, rows, _ = run.child(request, "the gallery while a light moves")
    keys = ("device", "blender", "scene", "picture", "cold_bake_seconds")
    found = ("cold_picture_seconds", "longest_steps", "limits", "profiled_seconds", "shaders", "functions", "problem")
    return {key: merged[key] for key in keys} | {key: merged.get(key) for key in found} | {"rows": rows}


def table(summary: dict) -> list[str]:
    scene = summary["scene"]
    width, height = summary["picture"]
    lines = [
        f"{scene['name']}, {scene['triangles']} triangles, {scene['active']} active probes, "
        f"{scene['lights']} lamps; one of them moves on a circle of 40 cm",
        "",
        "Milliseconds with the GPU waited for. A slice ends at the first step that ends after 1/60 s.",
        f"Pictures are {width}×{height}, one sample, as the viewport draws them. Cold: first bake "
        f"{_ms(summary['cold_bake_seconds'])}, first picture {_ms(summary['cold_picture_seconds'] or 0.0)}.",
        "",
    ]
    cells = [["", "median", "99th percentile", "longest", "count"]]
    for row in summary["rows"]:
        times = [_ms(row[name]) for name in ("median", "percentile_99", "longest")]
        cells.append([row["run"], *times, str(row["count"])])
    lines += bench_table.columns(cells)
    if summary["longest_steps"]:
        lines += [
            "",
            "Bakes beside the interface: a timer event takes steps for 20 ms. Longest warm step, ms, by phase",
        ]
        lines += bench_table.columns([["phase", "ms"], *[[k, _ms(v)] for k, v in summary["longest_steps"].items()]])
    for row in summary["rows"]:
        if "phases" in row:
            watched = row["watched_seconds"]
            lines += [
                "",
                f"{row['run']}: {row['patches']} patches, {row['iterations']} bounces. With a wait after every piece "
                f"of work it takes {_ms(watched)} ms, of which",
            ]
            rest = watched - sum(row["phases"].values())
            phases = {**row["phases"], "outside of all phases": rest}
            lines += bench_table.columns([["phase", "ms"], *[[name, _ms(value)] for name, value in phases.items()]])
    if summary["shaders"]:
        lines += ["", *_shader_table(summary)]
    if summary["functions"]:
        lines += ["", "Python, by time of its own, ms a relight (the profiler makes all of it slower)"]
        cells = [["function", "calls", "own", "whole"]]
        for item in summary["functions"]:
            cells.append(
                [item["function"], f"{item['calls']:.1f}", _ms(item["own_seconds"]), _ms(item["whole_seconds"])]
            )
        lines += bench_table.columns(cells)
    if summary["problem"]:
        lines += ["", f"ended early: {summary['problem']}"]
    return lines


def _shader_table(summary: dict) -> list[str]:
    limits = summary["limits"]
    lines = [
        f"Per shader, of a relight that takes {_ms(summary['profiled_seconds'])} ms with a wait after every dispatch; "
        f"a wait with nothing to do takes {_ms(limits['wait_seconds'])}, which is part of every dispatch.",
        "MB: of all arrays and images that dispatches are given, each once, whatever of it they read and how often.",
        f"Share: of the {limits['copy_bytes_per_second'] / 1e9:.4g} GB/s that copying reaches here, waits taken off.",
        "Operations: what arithmetic alone could do for each of these bytes in the time that the dispatch takes, at",
        f"the {limits['operations_per_second'] / 1e12:.3g} T/s that it reaches here. What does fewer is bound by "
        "latency or by too few threads.",
    ]
    cells = [["shader", "dispatches", "ms", "without waits", "groups", "MB", "GB/s", "share", "operations"]]
    ordered = sorted(summary["shaders"].items(), key=lambda item: -item[1]["seconds"])
    for name, cost in ordered:
        spent = max(cost["seconds"] - cost["dispatches"] * limits["wait_seconds"], 1e-7)
        rate = cost["bytes"] / spent
        below = spent < 0.5 * cost["dispatches"] * limits["wait_seconds"]  # lost in the wait: no rate can be told
        cells.append(
            [
                name,
                f"{cost['dispatches']:.1f}",
                _ms(cost["seconds"]),
                _ms(spent),
                f"{cost['groups']:.0f}",
                f"{cost['bytes'] / 1e6:.3g}",
                "–" if below else f"{rate / 1e9:.3g}",
                "–" if below else f"{rate / limits['copy_bytes_per_second']:.1%}",
                "–" if below else bench_table.significant(limits["operations_per_second"] / rate),
            ]
        )
    total = sum(cost["seconds"] for cost in summary["shaders"].values())
    cells.append(["all", f"{sum(c['dispatches'] for c in summary['shaders'].values()):.1f}", _ms(total)])
    cells.append(["not in dispatches", "", _ms(max(summary["profiled_seconds"] - total, 0.0))])
    return lines + bench_table.columns(cells)


def plot(summary: dict) -> str:
    """Time against memory of every shader."""
    chart = bench_chart.Chart("Dispatches of a relight", "bytes that a relight's dispatches are given", "seconds")
    for name, cost in (summary["shaders"] or {}).items():
        chart.points(name, [cost["bytes"]], [cost["seconds"]], [f"{1e3 * cost['seconds']:.3g} ms"])
    return bench_chart.page("A relight after a light moved", summary, [chart])


def _ms(seconds: float) -> str:
    return bench_table.significant(1e3 * seconds)
