# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of ``bench peers`` as plain text."""

from __future__ import annotations

from .bench_table import columns, significant


def table(summary: dict) -> list[str]:
    """Scene, rows and phases of ``summary``, which holds what ``bench_peers.measure`` says."""
    return [*_scene(summary), "", *_rows(summary), "", *_notes(summary)]


def _scene(summary: dict) -> list[str]:
    scene, bake = summary["scene"], summary["bake"]
    probes = scene["probes"]
    return [
        f"scene     {scene['name']}, {scene['triangles']} triangles, {scene['locations']} locations "
        f"({'×'.join(map(str, scene['resolution']))})",
        f"our bake  {probes['active']} active, {probes['culled']} culled, {probes['invalid']} invalid; "
        f"{bake['iterations']} iterations, {'converged' if bake['converged'] else 'NOT converged'}; "
        f"capture {bake['capture']}",
    ]


def _rows(summary: dict) -> list[str]:
    errors = summary["reference"] is not None
    cells = [["peer", "setting", "run", "seconds", "probes/s", "× our warm", *(["error %"] if errors else [])]]
    for row in summary["rows"]:
        if row["seconds"] is None:
            cells.append([row["peer"], row["setting"], f"not measured: {row['problem']}"])
            continue
        scaled = row["measured"] < summary["scene"]["locations"]
        error = [f"{100 * row['error']['relative_rms']:.2f}" if row["error"] else "–"] if errors else []
        figures = [significant(row[name]) for name in ("seconds", "probes_per_second", "ratio_to_warm")]
        run = f"{row['measured']} scaled" if scaled else row["run"]
        cells.append([row["peer"], row["setting"], run, *figures, *error])
    return columns(cells, left=3)


def _notes(summary: dict) -> list[str]:
    lines = [
        "Seconds for all locations; probes/s are locations by seconds. Every peer ran in a process of its own. Cold:",
        "first bake of its process, GPU context and shader compilation included. First: the same with shaders in the",
        "driver's cache, as in every process but a machine's first. Warm: the hierarchy is kept while triangles stay.",
        "Building the scene is not counted. Persistent: Cycles with persistent data; its first panorama carries the",
        "scene over. Projecting panoramas to SH is not counted.",
    ]
    if any(0 < row["measured"] < summary["scene"]["locations"] for row in summary["rows"]):
        lines.append(
            "Scaled: so many locations were measured; their mean time, the first aside, stands for the others."
        )
    reference = summary["reference"]
    if reference:
        size = f"{reference['width']}×{reference['height']}"
        lines += [
            f"Error: relative RMS of irradiance at {reference['nodes']} free nodes, 6 normals, against Cycles {size},",
            f"{reference['seeds']} × {reference['samples']} samples, whose noise is {100 * reference['noise']:.2f} %. "
            f"A perfect {reference['bands']}-band probe has {100 * reference['floor']['relative_rms']:.2f} %.",
            "EEVEE's probes cannot be read: its light is that of white cards at the nodes, rendered after the bake.",
        ]
    lines += ["", "Seconds by phase"]
    for row in summary["rows"]:
        if row["phases"]:
            phases = ", ".join(f"{name} {significant(value)}" for name, value in row["phases"].items() if value >= 1e-5)
            lines.append(f"{row['peer']}, {row['setting']}, {row['run']}: {phases}")
    return lines
