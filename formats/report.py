# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of a bake: one HTML file that needs nothing else, for people to read and to keep.

Everything that comes from a scene (names, warnings, settings) is data and is escaped; the page's own script is the only
one that its content policy lets run, and nothing is ever loaded from elsewhere.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
from dataclasses import dataclass
from dataclasses import field as default
from html import escape
from pathlib import Path

import numpy as np

from ..core.conventions import ACTIVE, LUMINANCE
from ..core.field import Field
from ..core.probe_states import CULLED_MEANS, invalid_counts, invalid_in_words
from ..core.ringing import ringing
from ..core.spherical_harmonics import irradiance
from . import report_figures as figures
from .report_slices import slices_html

_HERE = Path(__file__).parent
_SIX_SIDES = np.concatenate([np.eye(3), -np.eye(3)])


@dataclass
class VolumeReport:
    """One baked volume. ``energy`` and ``change`` hold a value per iteration: mean luminance of the irradiance of
    surfaces that probes see, and its relative change."""

    field: Field
    name: str = ""
    energy: list[float] = default(default_factory=list)
    change: list[float] = default(default_factory=list)
    iterations: int = 0
    converged: bool = True
    notes: list[str] = default(default_factory=list)
    error: dict | None = None  # of a bake that was given a target, see bake/error_driven.py


@dataclass
class ReportData:
    """What a report shows. Everything but ``title`` and ``volumes`` may stay empty.

    ``counts`` are the probes by state as in the JSON summary, ``seconds`` times per phase, ``notes`` what was chosen
    automatically and why, ``images`` pairs of caption and PNG file.
    """

    title: str
    volumes: list[VolumeReport]
    settings: dict = default(default_factory=dict)
    device: str = ""
    blender: str = ""
    generator: str = ""
    counts: dict = default(default_factory=dict)
    seconds: dict[str, float] = default(default_factory=dict)
    notes: list[str] = default(default_factory=list)
    warnings: list[str] = default(default_factory=list)
    images: list[tuple[str, bytes]] = default(default_factory=list)
    summary: dict = default(default_factory=dict)


def write_report(path, report: ReportData) -> None:
    """Writes ``report`` as one HTML file; see ``write_page``."""
    write_page(path, report_html(report))


def write_page(path, text: str) -> None:
    """Writes a page as one file that appears whole or not at all.

    Raises:
        OSError: the file cannot be written; nothing is left behind.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        # Names in a scene may hold lone surrogates, which UTF-8 cannot: show them as question marks.
        temporary.write_bytes(text.encode("utf-8", errors="replace"))
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def report_html(report: ReportData) -> str:
    """The page's text."""
    facts = [report.device, f"Blender {report.blender}" if report.blender else "", report.generator]
    sections = [
        page_header(report.title, facts),
        _cards(report),
        _warnings(report),
        _pictures(report),
        _volumes(report),
        _timings(report),
        _notes(report),
        _settings(report),
        _summary(report),
    ]
    return page(report.title, sections)


def page(title: str, sections: list[str]) -> str:
    """An HTML page with the reports' style and script; ``sections`` are HTML, empty ones are left out."""
    style = (_HERE / "report.css").read_text(encoding="utf-8")
    script = (_HERE / "report.js").read_text(encoding="utf-8")
    allowed = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{allowed}'"
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)} · Gridlight</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(section for section in sections if section)
        + f"\n</main>\n<script>{script}</script>\n</body>\n</html>\n"
    )


def page_header(title: str, facts: list[str]) -> str:
    """The head of a page: its title and a line of facts."""
    line = " · ".join(escape(fact) for fact in facts if fact)
    return f"<header><h1>{escape(title)}</h1><p>{line}</p></header>"


def _cards(report: ReportData) -> str:
    cards = []
    invalid = invalid_in_words(invalid_counts([volume.field for volume in report.volumes]))
    for key, text in (
        ("total", "probes in all"),
        ("active", "active"),
        ("culled", CULLED_MEANS),
        ("invalid", f"invalid: {invalid}"),
    ):
        if key in report.counts:
            cards.append((f"{report.counts[key]:,}".replace(",", " "), text, ""))
    iterations = max((volume.iterations for volume in report.volumes), default=0)
    settled = all(volume.converged for volume in report.volumes)
    cards.append(
        (
            str(iterations),
            "iterations until the light settled" if settled else "iterations, not settled",
            "good" if settled else "bad",
        )
    )
    if "total" in report.seconds:
        cards.append((figures.duration(report.seconds["total"]), "in total", ""))
    html = "".join(
        f'<div class="card {kind}"><b>{escape(value)}</b><span>{text}</span></div>' for value, text, kind in cards
    )
    return f'<section class="cards">{html}</section>'


def _warnings(report: ReportData) -> str:
    if not report.warnings:
        return ""
    return f'<section><h2>Warnings</h2><div class="box warnings">{_list(report.warnings)}</div></section>'


def _pictures(report: ReportData) -> str:
    if not report.images:
        return ""
    shown = []
    for caption, data in report.images:
        source = f"data:image/png;base64,{base64.b64encode(data).decode()}"
        shown.append(
            f'<figure><img src="{source}" alt="{escape(caption, quote=True)}">'
            f"<figcaption>{escape(caption)}</figcaption></figure>"
        )
    return f'<section><h2>Pictures</h2><div class="pictures">{"".join(shown)}</div></section>'


def _volumes(report: ReportData) -> str:
    parts = []
    for index, volume in enumerate(report.volumes):
        name = volume.name or volume.field.grid.name
        shape = " × ".join(map(str, volume.field.grid.resolution))
        cell = " × ".join(figures.number(length) for length in volume.field.grid.cell_size())
        bands = volume.field.bands
        parts.append(
            f"<section><h2>{escape(name)}</h2><p>{shape} probes, cells of {cell} m, "
            f"{bands} {'band' if bands == 1 else 'bands'} of spherical harmonics.</p>"
            f"{_predicted(volume)}{_settling(volume, report.settings)}"
            f'<h2>The field, level by level</h2><div class="box">{slices_html(volume.field, f"volume{index}")}</div>'
            f'<div class="pair" style="margin-top:16px"><div class="box"><h3>How bright the probes are</h3>'
            f"{figures.histogram(_mean_irradiance(volume.field), 'Histogram of irradiance', 'W/m²')}"
            f'<p class="legend">Active probes by irradiance, mean of six sides.</p></div>'
            f'<div class="box"><h3>Numbers</h3>{_numbers(volume.field)}</div></div></section>'
        )
    return "\n".join(parts)


def _predicted(volume: VolumeReport) -> str:
    """What a bake that was given a target says of its error."""
    error = volume.error
    if not error:
        return ""
    if error["predicted"] is None:
        return f'<div class="box"><h3>Error at probes</h3><p>Not estimated: {escape(error["reason"])}.</p></div>'
    outcome = "met" if error["met"] else f"not reached, stopped by {error['stopped']}"
    rows = {
        f"target, {outcome}": error["target"],
        "predicted at probes": error["predicted"],
        "at most, as sure as the estimate is": error["predicted_at_most"],
        "between probes, not covered by the target": error["between"],
    }
    rows |= {f"part: {name}": value for name, value in error["parts"].items()}
    table = {name: "unknown" if value is None else f"{100 * value:.2f} %" for name, value in rows.items()}
    kept = ", ".join(f"{count} with {bands}" for bands, count in error["bands"].items() if count)
    return (
        f'<div class="box"><h3>Error at probes</h3>{_table(table)}<p class="legend">Relative RMS of irradiance against '
        f"{error['paths']} paths; its parts add up as squares. Bands that probes keep: {kept}.</p>"
        f"{_list(error['passes'])}</div>"
    )


def _settling(volume: VolumeReport, settings: dict) -> str:
    if not volume.energy:
        return ""
    tolerance = settings.get("tolerance")
    tolerance = float(tolerance) if isinstance(tolerance, (int, float)) else None
    label = f"tolerance {figures.number(tolerance)}" if tolerance else ""
    settled = "The light settled" if volume.converged else "The light did not settle"
    text = f"{settled} in {volume.iterations} iteration{'s' * (volume.iterations != 1)}; each adds one more bounce."
    change = ""
    if volume.change:
        first = len(volume.energy) - len(volume.change) + 1
        change = (
            f'<div class="box"><h3>Relative change from one iteration to the next</h3>'
            f"{figures.curve(volume.change, 'Change per iteration', True, tolerance, label, first)}</div>"
        )
    return (
        f'<p>{text}</p><div class="pair"><div class="box"><h3>Light on surfaces</h3>'
        f"{figures.curve(volume.energy, 'Light on surfaces per iteration')}</div>{change}</div>{_list(volume.notes)}"
    )


def _mean_irradiance(baked: Field) -> np.ndarray:
    """(active probes,) luminance of the irradiance, mean over the six axis directions, W/m²."""
    active = baked.coefficients[baked.state == ACTIVE]
    sides = irradiance(active[:, None], _SIX_SIDES) if len(active) else np.zeros((0, 6, 3))
    return np.maximum(sides, 0).mean(axis=1) @ LUMINANCE


def _numbers(baked: Field) -> str:
    values = _mean_irradiance(baked)
    if not len(values):
        return '<p class="empty">no active probe</p>'
    low, median, high = np.percentile(values, (1, 50, 99))
    rows = {
        "darkest hundredth below": f"{figures.number(low)} W/m²",
        "median": f"{figures.number(median)} W/m²",
        "brightest hundredth above": f"{figures.number(high)} W/m²",
        "lowest validity of an active probe": figures.number(float(baked.validity[baked.state == ACTIVE].min())),
        "probes moved out of surfaces": str(int((np.abs(baked.offset).max(axis=1) > 0).sum())),
        "probes with irradiance below zero": _ringing(baked),
    }
    return _table(rows)


def _ringing(baked: Field) -> str:
    found = ringing(baked.coefficients[baked.state == ACTIVE])
    return (
        f"{found.negative}, lowest {figures.number(100 * found.lowest)} % of the probe's mean"
        if found.negative
        else "0"
    )


def _timings(report: ReportData) -> str:
    if not report.seconds:
        return ""
    return f'<section><h2>Where the time went</h2><div class="box">{figures.phase_bars(report.seconds)}</div></section>'


def _notes(report: ReportData) -> str:
    if not report.notes:
        return ""
    heading = "<h2>What was chosen automatically, and why</h2>"
    return f'<section>{heading}<div class="box">{_list(report.notes)}</div></section>'


def _settings(report: ReportData) -> str:
    if not report.settings:
        return ""
    return f'<section><h2>Settings</h2><div class="box">{_table(report.settings)}</div></section>'


def _summary(report: ReportData) -> str:
    if not report.summary:
        return ""
    text = json.dumps(report.summary, indent=2, ensure_ascii=False, default=str)
    return f"<section><h2>Summary</h2><details><summary>as JSON</summary><pre>{escape(text)}</pre></details></section>"


def _list(lines: list[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(str(line))}</li>' for line in lines)}</ul>" if lines else ""


def _table(rows: dict) -> str:
    body = "".join(
        f"<tr><th>{escape(str(name))}</th><td>{escape(str(value))}</td></tr>" for name, value in rows.items()
    )
    return f"<table>{body}</table>"
