# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of ``bench peers`` as plain text."""

from __future__ import annotations

_LOADED = 0.3  # of the cores busy before the bench began: times are then no longer those of an idle machine


def table(summary: dict) -> str:
    """Head, rows and phases of ``summary`` as ``bench_peers.run`` makes it."""
    return "\n".join([*_head(summary), "", *_rows(summary), "", *_notes(summary)])


def _head(summary: dict) -> list[str]:
    machine, scene, bake = summary["machine"], summary["scene"], summary["bake"]
    probes = scene["probes"]
    lines = [
        f"command   {summary['command']}",
        f"versions  Gridlight {summary['version']}, Blender {summary['blender']}",
        f"GPU       {summary['device']}",
        f"CPU       {machine['cores']} × {machine['processor']}, {machine['system']} (Cycles runs here)",
        f"scene     gallery, {scene['triangles']} triangles, {scene['locations']} locations "
        f"({'×'.join(map(str, scene['resolution']))})",
        f"our bake  {probes['active']} active, {probes['culled']} culled, {probes['invalid']} invalid; "
        f"{bake['iterations']} iterations, {'converged' if bake['converged'] else 'NOT converged'}; "
        f"capture {bake['capture']}",
    ]
    load = machine["load_before"]
    if load is not None and load > _LOADED * machine["cores"]:
        lines.append(f"load      {load:.1f} before the bench began: the times are not those of an idle machine")
    return lines


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
    widths = [max(len(line[column]) for line in cells if len(line) == len(cells[0])) for column in range(len(cells[0]))]
    for column in (0, 1):  # rows without figures have these too
        widths[column] = max(len(line[column]) for line in cells)
    return [
        "  ".join(
            cell.ljust(width) if column < 3 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths))
        ).rstrip()
        for line in cells
    ]


def _notes(summary: dict) -> list[str]:
    lines = [
        "Seconds for all locations; probes/s are locations by seconds. Every peer ran in a process of its own, driver",
        "shader caches off. Cold: first bake of its process, GPU context and shader compilation included.",
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
            "EEVEE's probes cannot be read.",
        ]
    lines += ["", "Seconds by phase"]
    for row in summary["rows"]:
        if row["phases"]:
            phases = ", ".join(f"{name} {significant(value)}" for name, value in row["phases"].items() if value >= 1e-5)
            lines.append(f"{row['peer']}, {row['setting']}, {row['run']}: {phases}")
    return lines


def significant(value: float) -> str:
    """Three significant digits, without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.6f}" if value < 1e-3 else f"{value:#.3g}"
