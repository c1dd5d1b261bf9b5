# SPDX-License-Identifier: GPL-3.0-or-later
"""``gridlight bench pareto``: error against Cycles over time, for many settings of ours and of the peers."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from . import bench_chart, bench_table
from .bench_peers import Peers, cycles_request, not_measured, panorama_name
from .bench_run import SCENES, Run

# Added to the settings of the command line; the first is the default, which errors of speed are related to.
OUR_SETTINGS: tuple[dict, ...] = (
    {},
    {"face": 8},
    {"face": 12},
    {"face": 32},
    {"samples": 4},
    {"face": 32, "samples": 4},
    {"capture": "raster"},
    {"capture": "trace"},
    {"bounces": 1},
    {"bounces": 3},
    {"bands": 2},
    {"bands": 4},
    {"gather": 1},
    {"gather": 2},
    {"samples": 2},
    {"face": 8, "capture": "raster"},
    {"gather": 2, "samples": 4},
)
CYCLES_SETTINGS = (
    (32, 16, 4),
    (32, 16, 8),
    (32, 16, 16),
    (64, 32, 4),
    (64, 32, 8),
    (64, 32, 16),
    (64, 32, 64),
    (128, 64, 8),
    (128, 64, 64),
    (128, 64, 256),
)
THREE_SETTINGS = tuple({"bounces": bounces, "cubemapSize": size} for bounces, size in ((0, 8), (1, 8), (5, 8), (5, 16)))
EEVEE_SAMPLES = (64, 256, 2048)
_CHEAP_SETTINGS = 5  # of Cycles: those that may win
_OUR_SHARE = 0.45  # of a scene's time: the dearest of our settings are left out before peers are
_OURS, _CYCLES, _EEVEE, _THREE = "Gridlight", "Cycles panoramas", "EEVEE volume", "three.js"
_SOFTWARE = ("llvmpipe", "softpipe", "swrast")  # renderers beside which Chromium's software is the fair one


def measure(run: Run) -> dict:
    """Facts of the summary: a part per scene. One that fails is told of and leaves the others.

    Raises:
        InputError: no scene could be measured.
    """
    names = [name if name in SCENES else str(Path(name).resolve()) for name in run.args.scene or SCENES]
    parts = []
    for index, name in enumerate(names):
        with run.within(run.left_s / (len(names) - index)):
            parts.append(_scene(run, name))
    known = [part for part in parts if part["device"]]
    if not known:
        raise InputError(f"no scene could be measured: {parts[0]['problem']}")
    return {"device": known[0]["device"], "blender": known[0]["blender"], "scenes": parts}


def _scene(run: Run, name: str) -> dict:
    """One scene: ours, the reference, then one measurement of every peer before the dear ones."""
    peers = Peers(run)
    facts, nodes = _ours(run, name, peers)
    part = {
        "name": name if name in SCENES else Path(name).name,
        "device": facts.get("device"),
        "blender": facts.get("blender"),
        "scene": facts.get("scene"),
        "problem": facts.get("problem"),
        "left_out": facts.get("left_out", []),
        "reference": None,
        "rows": peers.rows,
    }
    if not peers.rows or not nodes:
        return part
    part["reference"] = peers.errors(name, nodes, run.args.error_spp, run.settings.bands)
    _cycles(run, name, nodes, peers, CYCLES_SETTINGS[:_CHEAP_SETTINGS])
    if not run.args.no_three:
        part["three"] = _three(run, name, nodes, facts["device"], peers)
    _eevee(run, name, nodes, peers, EEVEE_SAMPLES[:1])
    _cycles(run, name, nodes, peers, CYCLES_SETTINGS[_CHEAP_SETTINGS:])
    _eevee(run, name, nodes, peers, EEVEE_SAMPLES[1:])
    peers.relate(facts["scene"]["locations"], peers.rows[0]["seconds"])
    part["best"] = best(peers.rows, part["reference"])
    return part


def _ours(run: Run, name: str, peers: Peers) -> tuple[dict, list]:
    """Measures our settings. Where a process ends early the next one goes on behind the setting that it was at.

    Returns (what was reported, nodes).
    """
    waiting = [dict(item) for item in OUR_SETTINGS]
    ends = time.perf_counter() + _OUR_SHARE * run.left_s
    facts: dict = {}
    nodes = run.args.error_nodes
    while waiting:
        request = {
            "peer": "settings",
            "scene": name,
            "settings": [{**run.settings_dict, **item} for item in waiting],
            "nodes": nodes,
            "seconds": min(0.9 * run.limit_s, ends - time.perf_counter()),
        }
        merged, rows, _ = run.child(request, f"{_OURS}, {len(waiting)} settings of {name}", optional=True)
        facts = {**facts, **merged}
        nodes = merged.get("nodes", nodes)
        for row, item in zip(rows, waiting):
            irradiance = np.array(row.pop("irradiance"))
            peers.add(_OURS, setting_name(item), row, irradiance)
        waiting = waiting[len(rows) :]
        if "problem" not in merged:
            if waiting:
                facts["left_out"] = [setting_name(item) for item in waiting]
            break
        if not peers.rows:
            return facts, []  # not even the default
        if waiting:
            peers.add(_OURS, setting_name(waiting.pop(0)), not_measured(merged["problem"]), None)
    return facts, nodes if isinstance(nodes, list) else []


def _cycles(run: Run, name: str, nodes: list, peers: Peers, panoramas) -> None:
    for panorama in panoramas:
        request = cycles_request(name, panorama, run.args.panoramas, nodes, run.settings.bands)
        peers.measure(request, _CYCLES, panorama_name(panorama))


def _eevee(run: Run, name: str, nodes: list, peers: Peers, sample_counts) -> None:
    for samples in () if run.args.no_eevee else sample_counts:
        request = {"peer": "eevee", "scene": name, "samples": samples, "nodes": nodes}
        peers.measure(request, _EEVEE, f"{samples} samples")


def _three(run: Run, name: str, nodes: list, device: str, peers: Peers) -> dict | None:
    """three.js's own bake; returns its revision and the device it ran on."""
    request = {
        "peer": "three",
        "scene": name,
        "nodes": nodes,
        "settings": THREE_SETTINGS,
        "software": any(word in device.lower() for word in _SOFTWARE),
        "seconds": max(0.9 * run.limit_s, 1.0),
    }
    merged, rows, _ = run.child(request, f"{_THREE}, {len(THREE_SETTINGS)} settings of {name}", optional=True)
    for row in rows:
        options = row.pop("options")
        size = options["cubemapSize"]
        peers.add(_THREE, f"{size}² faces, {options['bounces']} bounces", row, np.array(row.pop("irradiance")))
    if "problem" in merged:
        peers.add(_THREE, "all", not_measured(merged["problem"]), None)
    return merged.get("three")


def setting_name(item: dict) -> str:
    return ", ".join(f"{name} {value}" for name, value in item.items()) or "default"


def best(rows: list[dict], reference: dict | None) -> dict | None:
    """The fastest rows of ours and of Cycles that are at most 2 % off, or as near as Cycles' best where none is."""
    if reference is None:
        return None
    measured = [row for row in rows if row["error"]]
    ours = [row for row in measured if row["peer"] == _OURS]
    theirs = [row for row in measured if row["peer"] == _CYCLES]
    if not ours or not theirs:
        return None
    found = {}
    for limit in (0.02, 0.03, 0.05):
        good = ([row for row in side if row["error"]["relative_rms"] <= limit] for side in (ours, theirs))
        pair = [min(side, key=lambda row: row["seconds"], default=None) for side in good]
        found[f"{100 * limit:g}"] = [
            row and {"setting": row["setting"], "seconds": row["seconds"], "error": row["error"]["relative_rms"]}
            for row in pair
        ]
    return found


def table(summary: dict) -> list[str]:
    lines = [
        "Seconds for all locations of the volume, ours warm (median of a few) and with reading the scene; Cycles with",
        "persistent data. Error: relative RMS of irradiance, six normals, at free active nodes.",
    ]
    for part in summary["scenes"]:
        lines += ["", *_part(part)]
    return lines


def _part(part: dict) -> list[str]:
    scene = part["scene"]
    if scene is None:
        return [f"{part['name']}: not measured: {part['problem']}"]
    lines = [f"{part['name']}: {scene['triangles']} triangles, {'×'.join(map(str, scene['resolution']))} locations"]
    reference = part["reference"]
    if reference:
        lines.append(
            f"reference: Cycles 128×64, {reference['seeds']} × {reference['samples']} samples, {reference['nodes']} "
            f"nodes; its noise {100 * reference['noise']:.2f} %; floor of {reference['bands']} bands "
            f"{100 * reference['floor']['relative_rms']:.2f} %"
        )
    cells = [["peer", "setting", "run", "seconds", "first", "probes/s", "error %", "bias %"]]
    for row in part["rows"]:
        if row["seconds"] is None:
            cells.append([row["peer"], row["setting"], f"not measured: {row['problem']}"])
            continue
        first = row["phases"].get("first bake")
        rate = scene["locations"] / row["seconds"]
        run = f"{row['measured']} scaled" if row["measured"] < scene["locations"] else row["run"]
        error = row["error"]
        cells.append(
            [
                row["peer"],
                row["setting"],
                run,
                bench_table.significant(row["seconds"]),
                "" if first is None else bench_table.significant(first),
                bench_table.significant(rate),
                f"{100 * error['relative_rms']:.2f}" if error else "–",
                f"{100 * error['bias']:+.2f}" if error else "–",
            ]
        )
    lines += bench_table.columns(cells, left=3)
    if part.get("three"):
        three = part["three"]
        lines.append(
            f"three.js r{three['revision']} on {three['device']}; spots of the same power stand in for area lights"
        )
    if part["left_out"]:
        lines.append(f"ours left out for lack of time: {'; '.join(part['left_out'])}")
    for limit, (ours, theirs) in (part.get("best") or {}).items():
        sides = f"{_side(_OURS, ours)}; {_side('Cycles', theirs)}"
        lines.append(f"fastest with at most {limit} %: {sides}{_lead(ours, theirs)}")
    return lines


def _side(name: str, row: dict | None) -> str:
    if row is None:
        return f"{name}: none"
    return f"{name} {row['setting']} {bench_table.significant(row['seconds'])} s ({100 * row['error']:.2f} %)"


def _lead(ours: dict | None, theirs: dict | None) -> str:
    return f"; {theirs['seconds'] / ours['seconds']:.3g} times faster" if ours and theirs else ""


def plot(summary: dict) -> str:
    """Error over time, a panel a scene."""
    charts = []
    for part in summary["scenes"]:
        chart = bench_chart.Chart(part["name"], "seconds for all locations", "error, % relative RMS")
        for peer in dict.fromkeys(row["peer"] for row in part["rows"]):
            rows = [row for row in part["rows"] if row["peer"] == peer and row["seconds"] and row["error"]]
            chart.points(
                peer,
                [row["seconds"] for row in rows],
                [100 * row["error"]["relative_rms"] for row in rows],
                [row["setting"] for row in rows],
            )
        charts.append(chart)
    return bench_chart.page("Error over time", summary, charts)
