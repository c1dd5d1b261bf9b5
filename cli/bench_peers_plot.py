# SPDX-License-Identifier: GPL-3.0-or-later
"""The result of ``bench peers`` as an SVG picture: error over time where errors were measured, else bars of time.

Both time axes are logarithmic: the peers are orders of magnitude apart.
"""

from __future__ import annotations

from html import escape

from .bench_chart import GREY, INK, Labels, Scale
from .bench_table import significant

_WIDTH, _LEFT, _RIGHT, _TOP, _BOTTOM = 860, 70, 40, 46, 46
_COLOURS = {"Gridlight": "#c2410c", "Cycles panoramas": "#1d4ed8", "EEVEE volume": "#15803d"}


def plot(summary: dict) -> str:
    """SVG text of ``summary`` as ``bench_peers.measure`` describes it."""
    rows = [row for row in summary["rows"] if row["seconds"] is not None]
    return _error_over_time(summary, rows) if summary["reference"] else _bars(summary, rows)


def _name(row: dict) -> str:
    return f"{row['peer']}, {_setting(row)}"


def _setting(row: dict) -> str:
    return row["setting"] if row["run"] == "persistent" else f"{row['setting']}, {row['run']}"


def _time_axis(scale: Scale, top: float, bottom: float) -> list[str]:
    parts = []
    for value, label in scale.ticks():
        at = scale(value)
        parts.append(
            f'<line x1="{at:.1f}" x2="{at:.1f}" y1="{top}" y2="{bottom}" stroke="{GREY}"/>'
            f'<text x="{at:.1f}" y="{bottom + 17}" text-anchor="middle">{label}</text>'
        )
    middle = (scale(10.0**scale.low) + scale(10.0**scale.high)) / 2
    parts.append(f'<text x="{middle:.1f}" y="{bottom + 36}" text-anchor="middle">seconds</text>')
    return parts


def _bars(summary: dict, rows: list[dict]) -> str:
    names_end = 310
    height = _TOP + 28 * len(rows) + _BOTTOM
    scale = Scale([row["seconds"] for row in rows], names_end, _WIDTH - 80)
    bottom = height - _BOTTOM
    parts = _time_axis(scale, _TOP, bottom)
    for index, row in enumerate(rows):
        top = _TOP + 28 * index + 5
        end, colour = scale(row["seconds"]), _COLOURS[row["peer"]]
        parts.append(
            f'<text x="{names_end - 8}" y="{top + 14}" text-anchor="end">{escape(_name(row))}</text>'
            f'<rect x="{names_end}" y="{top}" width="{max(end - names_end, 1):.1f}" height="19" fill="{colour}"/>'
            f'<text x="{end + 6:.1f}" y="{top + 14}">{significant(row["seconds"])} s</text>'
        )
    return _page(summary, height, "time to light all locations", parts)


def _error_over_time(summary: dict, rows: list[dict]) -> str:
    height = 520
    bottom = height - _BOTTOM
    reference = summary["reference"]
    floor = 100 * reference["floor"]["relative_rms"]
    errors = [100 * row["error"]["relative_rms"] for row in rows if row["error"]]
    across = Scale([row["seconds"] for row in rows], _LEFT, _WIDTH - _RIGHT)
    up = Scale([value for value in [*errors, floor] if value > 0], bottom, _TOP)
    parts = _time_axis(across, _TOP, bottom)
    for value, label in up.ticks():
        parts.append(
            f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{up(value):.1f}" y2="{up(value):.1f}" stroke="{GREY}"/>'
            f'<text x="{_LEFT - 8}" y="{up(value) + 4:.1f}" text-anchor="end">{label}</text>'
        )
    parts.append(
        f'<text transform="translate(18 {(_TOP + bottom) / 2}) rotate(-90)" text-anchor="middle">'
        "error, % relative RMS</text>"
    )
    if floor > 0:
        parts.append(
            f'<line x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{up(floor):.1f}" y2="{up(floor):.1f}" stroke="{INK}" '
            f'stroke-dasharray="2 4"/><text x="{_WIDTH - _RIGHT - 4}" y="{up(floor) - 6:.1f}" text-anchor="end">'
            f"floor of {reference['bands']} bands</text>"
        )
    labels = Labels(_LEFT, _WIDTH - _RIGHT)
    for row in rows:
        x, colour = across(row["seconds"]), _COLOURS[row["peer"]]
        if row["error"]:
            y = up(100 * row["error"]["relative_rms"])
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="{colour}"/>')
            parts.append(labels.beside(x, y, _setting(row)))
        else:  # its time is known, its error is not
            text = escape(f"{_name(row)}: error not readable")
            parts.append(
                f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{_TOP}" y2="{bottom}" stroke="{colour}" '
                'stroke-width="2" stroke-dasharray="6 4"/>'
                f'<text transform="translate({x - 6:.1f} {bottom - 10}) rotate(-90)">{text}</text>'
            )
    for index, peer in enumerate(dict.fromkeys(row["peer"] for row in rows)):
        left = _WIDTH - _RIGHT - 150 * (index + 1)
        parts.append(
            f'<rect x="{left - 6}" y="8" width="12" height="12" fill="{_COLOURS[peer]}"/>'
            f'<text x="{left + 11}" y="18">{escape(peer)}</text>'
        )
    return _page(summary, height, "error over time", parts)


def _page(summary: dict, height: int, title: str, parts: list[str]) -> str:
    scene = summary["scene"]
    heading = escape(f"Gallery, {scene['locations']} locations: {title}")
    device = escape(f"{summary['device']}; {summary['machine']['cores']} CPU cores; Blender {summary['blender']}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {height}" width="{_WIDTH}" height="{height}" '
        'font-family="sans-serif" font-size="13" '
        f'fill="{INK}"><title>{heading}</title><rect width="100%" height="100%" fill="#ffffff"/>'
        f'<text x="14" y="18" font-weight="bold">{heading}</text><text x="14" y="34" font-size="11">{device}</text>'
        f"{''.join(parts)}</svg>\n"
    )
