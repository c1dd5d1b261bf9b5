# SPDX-License-Identifier: GPL-3.0-or-later
"""Charts with two logarithmic axes as SVG: lines and points, several panels on a page."""

from __future__ import annotations

import math
from html import escape

GREY, INK = "#d4d4d4", "#262626"
COLOURS = ("#c2410c", "#1d4ed8", "#15803d", "#7e22ce", "#b45309", "#0e7490", "#be185d", "#4d7c0f")
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 860, 400, 70, 230, 34, 46


class Scale:
    """A logarithmic axis over whole decades from ``start`` to ``end`` in picture units."""

    def __init__(self, values: list[float], start: float, end: float):
        self.low = math.floor(math.log10(min(values)))
        self.high = max(math.ceil(math.log10(max(values))), self.low + 1)
        self._start, self._end = start, end

    def __call__(self, value: float) -> float:
        return self._start + (self._end - self._start) * (math.log10(value) - self.low) / (self.high - self.low)

    def ticks(self) -> list[tuple[float, str]]:
        """(value, label) at 1, 2 and 5 of every decade; only decades carry a label where there are many."""
        ticks = [(step * 10.0**power, step) for power in range(self.low, self.high) for step in (1, 2, 5)]
        ticks.append((10.0**self.high, 1))
        few = self.high - self.low <= 3
        return [(value, f"{value:g}" if few or step == 1 else "") for value, step in ticks]


class Labels:
    """Puts texts near points, between ``left`` and ``right`` of the picture, so that they do not cover each other."""

    _CHARACTER, _LINE = 7.2, 15  # room that a character and a line take

    def __init__(self, left: float, right: float):
        self._left, self._right = left, right
        self._taken: list[tuple[float, float, float]] = []  # left, right, baseline

    def beside(self, x: float, y: float, text: str) -> str:
        """``text`` above (x, y), else below it, else further up; shifted inwards at the edges of the picture."""
        width = self._CHARACTER * len(text)
        left = min(max(x - width / 2, self._left + 4), self._right - 4 - width)
        above = (y - 11 - self._LINE * step for step in range(20))
        for baseline in (y - 11, y + 21, *above):
            if all(left > r or left + width < l or abs(baseline - b) >= self._LINE for l, r, b in self._taken):
                break
        self._taken.append((left, left + width, baseline))
        return f'<text x="{left + width / 2:.1f}" y="{baseline:.1f}" text-anchor="middle">{escape(text)}</text>'


class Chart:
    """Series of points (x, y); those that are not greater than zero have no place here and are left out."""

    def __init__(self, title: str, across: str, up: str):
        self._title, self._across, self._up = title, across, up
        self._series: list[tuple[str, list[tuple[float, float, str]], str]] = []

    def line(self, name: str, xs, ys, dashed: bool = False) -> None:
        self._add(name, xs, ys, None, "dashed" if dashed else "line")

    def points(self, name: str, xs, ys, labels) -> None:
        """Unconnected points. Each has a text that appears under the pointer; those that no other of the series beats
        in both directions show it."""
        self._add(name, xs, ys, labels, "points")

    def _add(self, name, xs, ys, labels, kind) -> None:
        points = [(x, y, label) for x, y, label in zip(xs, ys, labels or [""] * len(xs)) if x > 0 and y > 0]
        if points:
            self._series.append((name, points, kind))

    def draw(self, top: float) -> tuple[list[str], float]:
        """SVG elements from ``top`` down, and the height that they take."""
        title = f'<text x="14" y="{top + 20}" font-weight="bold">{escape(self._title)}</text>'
        if not self._series:
            return [title, f'<text x="14" y="{top + 40}">nothing was measured</text>'], 60
        bottom = top + _HEIGHT - _BOTTOM
        every = [point for _, points, _ in self._series for point in points]
        across = Scale([x for x, _, _ in every], _LEFT, _WIDTH - _RIGHT)
        up = Scale([y for _, y, _ in every], bottom, top + _TOP)
        parts = [title]
        for value, label in across.ticks():
            parts += _rule(across(value), across(value), top + _TOP, bottom)
            parts.append(f'<text x="{across(value):.1f}" y="{bottom + 17}" text-anchor="middle">{label}</text>')
        for value, label in up.ticks():
            parts += _rule(_LEFT, _WIDTH - _RIGHT, up(value), up(value))
            parts.append(f'<text x="{_LEFT - 8}" y="{up(value) + 4:.1f}" text-anchor="end">{label}</text>')
        middle = (_LEFT + _WIDTH - _RIGHT) / 2
        parts.append(f'<text x="{middle}" y="{bottom + 36}" text-anchor="middle">{escape(self._across)}</text>')
        side = f"translate(18 {(top + _TOP + bottom) / 2}) rotate(-90)"
        parts.append(f'<text transform="{side}" text-anchor="middle">{escape(self._up)}</text>')
        texts = Labels(_LEFT, _WIDTH - _RIGHT)
        for index, (name, points, kind) in enumerate(self._series):
            colour = COLOURS[index % len(COLOURS)]
            if kind != "points":
                path = " ".join(f"{across(x):.1f},{up(y):.1f}" for x, y, _ in points)
                dash = ' stroke-dasharray="5 4"' if kind == "dashed" else ""
                parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>')
            for x, y, label in points:
                tip = f"<title>{escape(f'{name}: {label}' if label else name)}</title>"
                parts.append(f'<circle cx="{across(x):.1f}" cy="{up(y):.1f}" r="4" fill="{colour}">{tip}</circle>')
            for x, y, label in _unbeaten(points) if kind == "points" else ():
                parts.append(texts.beside(across(x), up(y), label))
            row = top + _TOP + 12 + 18 * index
            parts.append(
                f'<rect x="{_WIDTH - _RIGHT + 14}" y="{row - 9}" width="11" height="11" fill="{colour}"/>'
                f'<text x="{_WIDTH - _RIGHT + 31}" y="{row}">{escape(name)}</text>'
            )
        return parts, _HEIGHT


def page(title: str, summary: dict, charts: list[Chart]) -> str:
    """SVG text with all ``charts`` below each other, under a title and what it was measured on."""
    device = f"{summary['device']}; {summary['machine']['cores']} CPU cores; Blender {summary['blender']}"
    parts, top = [], 44.0
    for chart in charts:
        drawn, height = chart.draw(top)
        parts += drawn
        top += height
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {top:.0f}" width="{_WIDTH}" '
        f'height="{top:.0f}" font-family="sans-serif" font-size="13" fill="{INK}"><title>{escape(title)}</title>'
        '<rect width="100%" height="100%" fill="#ffffff"/>'
        f'<text x="14" y="18" font-weight="bold">{escape(title)}</text>'
        f'<text x="14" y="34" font-size="11">{escape(device)}</text>{"".join(parts)}</svg>\n'
    )


def _unbeaten(points: list[tuple[float, float, str]]) -> list[tuple[float, float, str]]:
    """Those than which no other is lower in both coordinates."""
    return [
        (x, y, text) for x, y, text in points if not any(a <= x and b <= y and (a, b) != (x, y) for a, b, _ in points)
    ]


def _rule(x1: float, x2: float, y1: float, y2: float) -> list[str]:
    return [f'<line x1="{x1:.1f}" x2="{x2:.1f}" y1="{y1:.1f}" y2="{y2:.1f}" stroke="{GREY}"/>']
