# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts of the report as inline SVG. They take their colours from the page's style, so they follow light and dark."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np

WIDTH, HEIGHT = 520, 230
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 14, 14, 40


def number(value: float) -> str:
    """Three significant digits, without an exponent where one can read it without."""
    if not np.isfinite(value):
        return str(value)
    if value == 0:
        return "0"
    return f"{value:.3g}" if 1e-3 <= abs(value) < 1e5 else f"{value:.2e}"


def duration(seconds: float) -> str:
    """Seconds in a unit that leaves digits to read."""
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    if seconds < 1:
        return f"{seconds * 1e3:.3g} ms"
    return f"{seconds:.2f} s" if seconds < 120 else f"{seconds / 60:.1f} min"


def curve(
    values: list[float],
    label: str,
    logarithmic: bool = False,
    threshold: float | None = None,
    threshold_label: str = "",
    first: int = 1,
) -> str:
    """A line over iterations ``first``, first + 1, …; values that are not finite, or not positive on a logarithmic
    axis, are left out.

    ``threshold`` draws a level with its label.
    """
    every = np.asarray(values, float)
    at = np.arange(first, first + len(every))
    shown = np.isfinite(every) & ((every > 0) if logarithmic else True)
    if not shown.any():
        return '<p class="empty">nothing to show</p>'
    drawn = every[shown]
    level = threshold if threshold and threshold > 0 else None
    axis = _Axis.around(drawn if level is None else np.append(drawn, level), logarithmic)

    def x(iteration):
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * (iteration - at[0] + 0.5) / max(len(at), 1)

    parts = [_open(label), *axis.grid()]
    step = max(1, int(np.ceil(len(at) / 12)))
    for iteration in at[::step]:
        parts.append(
            f'<text x="{x(iteration):.1f}" y="{HEIGHT - _BOTTOM + 17}" text-anchor="middle">{iteration}</text>'
        )
    parts.append(f'<text class="axis" x="{(WIDTH + _LEFT) / 2}" y="{HEIGHT - 6}" text-anchor="middle">iteration</text>')
    if level is not None:
        parts.append(
            f'<line class="threshold" x1="{_LEFT}" x2="{WIDTH - _RIGHT}" y1="{axis.y(level):.1f}" '
            f'y2="{axis.y(level):.1f}"/>'
            f'<text class="threshold" x="{WIDTH - _RIGHT}" y="{axis.y(level) - 5:.1f}" text-anchor="end">'
            f"{escape(threshold_label)}</text>"
        )
    points = [(x(iteration), axis.y(value), value, iteration) for iteration, value in zip(at[shown], drawn)]
    if len(points) > 1:
        parts.append(f'<polyline class="line" points="{" ".join(f"{px:.1f},{py:.1f}" for px, py, *_ in points)}"/>')
    if len(points) <= 80:
        parts += [
            f'<circle class="dot" cx="{px:.1f}" cy="{py:.1f}" r="3.5">'
            f"<title>iteration {iteration}: {number(value)}</title>"
            "</circle>"
            for px, py, value, iteration in points
        ]
    return "".join(parts) + "</svg>"


@dataclass(frozen=True)
class _Axis:
    """An upright axis from ``low`` to ``high``, which are exponents of ten where it is ``logarithmic``."""

    low: float
    high: float
    ticks: np.ndarray  # values
    names: list[str]
    logarithmic: bool

    @classmethod
    def around(cls, values: np.ndarray, logarithmic: bool) -> _Axis:
        """From zero, or from the power of ten below, to where all ``values`` fit."""
        if not logarithmic:
            most = float(values.max()) or 1.0
            ticks = _round_ticks(0.0, most)
            return cls(0.0, max(float(ticks[-1]), most), ticks, [number(tick) for tick in ticks], False)
        low, high = np.floor(np.log10(values.min())), np.ceil(np.log10(values.max()))
        high = max(high, low + 1)
        exponents = np.arange(low, high + 1, max(1, np.ceil((high - low) / 6)))
        return cls(low, high, 10**exponents, [f"10{_superscript(int(exponent))}" for exponent in exponents], True)

    def y(self, value: float) -> float:
        """Where ``value`` stands in the figure."""
        height = np.log10(value) if self.logarithmic else value
        return HEIGHT - _BOTTOM - (HEIGHT - _TOP - _BOTTOM) * (height - self.low) / (self.high - self.low)

    def grid(self) -> list[str]:
        """A line and a name for each tick."""
        return [
            f'<line class="grid" x1="{_LEFT}" x2="{WIDTH - _RIGHT}" y1="{self.y(tick):.1f}" y2="{self.y(tick):.1f}"/>'
            f'<text x="{_LEFT - 8}" y="{self.y(tick) + 4:.1f}" text-anchor="end">{name}</text>'
            for tick, name in zip(self.ticks, self.names)
        ]


def histogram(values: np.ndarray, label: str, unit: str) -> str:
    """Counts of positive ``values`` in logarithmic bins."""
    values = np.asarray(values, float)
    values = values[np.isfinite(values) & (values > 0)]
    if not len(values):
        return '<p class="empty">nothing to show</p>'
    low, high = np.log10(values.min()), np.log10(values.max())
    if high - low < 0.02:
        low, high = low - 0.05, high + 0.05
    counts, edges = np.histogram(
        np.log10(values), bins=int(np.clip(np.sqrt(len(values)) * 2, 8, 48)), range=(low, high)
    )
    plot_width, plot_height = WIDTH - _LEFT - _RIGHT, HEIGHT - _TOP - _BOTTOM
    scale = plot_height / counts.max()
    bar = plot_width / len(counts)
    parts = [_open(label)]
    for tick in _round_ticks(0, float(counts.max())):
        level = HEIGHT - _BOTTOM - tick * scale
        parts.append(
            f'<line class="grid" x1="{_LEFT}" x2="{WIDTH - _RIGHT}" y1="{level:.1f}" y2="{level:.1f}"/>'
            f'<text x="{_LEFT - 8}" y="{level + 4:.1f}" text-anchor="end">{tick:.0f}</text>'
        )
    for index, count in enumerate(counts):
        span = f"{number(10 ** edges[index])} to {number(10 ** edges[index + 1])}"
        parts.append(
            f'<rect class="bar" x="{_LEFT + index * bar + 0.5:.1f}" y="{HEIGHT - _BOTTOM - count * scale:.1f}" '
            f'width="{max(bar - 1, 0.5):.1f}" height="{count * scale:.1f}">'
            f"<title>{span} {escape(unit)}: {count}</title></rect>"
        )
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        where = _LEFT + share * plot_width
        parts.append(
            f'<text x="{where:.1f}" y="{HEIGHT - _BOTTOM + 17}" text-anchor="middle">'
            f"{number(10 ** (low + share * (high - low)))}</text>"
        )
    parts.append(
        f'<text class="axis" x="{(WIDTH + _LEFT) / 2}" y="{HEIGHT - 6}" text-anchor="middle">{escape(unit)}, '
        "logarithmic</text>"
    )
    return "".join(parts) + "</svg>"


def phase_bars(seconds: dict[str, float]) -> str:
    """One bar per phase, as long as its share of the longest; ``total`` closes the list without a bar."""
    phases = {name: value for name, value in seconds.items() if name != "total"}
    longest = max([*phases.values(), 1e-12])
    rows = []
    for name, value in phases.items():
        rows.append(
            f'<div class="phase"><span>{escape(name)}</span><i><b style="width:{100 * value / longest:.2f}%"></b></i>'
            f"<em>{duration(value)}</em></div>"
        )
    if "total" in seconds:
        rows.append(f'<div class="phase total"><span>total</span><i></i><em>{duration(seconds["total"])}</em></div>')
    return "".join(rows)


def _open(label: str) -> str:
    return f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(label, quote=True)}">'


def _round_ticks(low: float, high: float) -> np.ndarray:
    """About five round values from ``low`` to ``high``."""
    raw = (high - low) / 5
    magnitude = 10 ** np.floor(np.log10(raw))
    step = magnitude * min((1, 2, 2.5, 5, 10), key=lambda candidate: abs(candidate - raw / magnitude))
    return np.arange(np.ceil(low / step), np.floor(high / step + 1e-9) + 1) * step


def _superscript(value: int) -> str:
    return str(value).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
