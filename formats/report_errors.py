# SPDX-License-Identifier: GPL-3.0-or-later
"""The report of ``verify``: a table, maps of where the error is, and the worst points, as one HTML file."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

import numpy as np

from ..core.grid import Grid
from ..core.measures import ErrorFigures, NegativeValues
from ..core.snapshot import SceneSnapshot
from .report import page, page_header
from .report_figures import histogram, number

_VIEWS = (("from above", 0, 1), ("from the front", 0, 2), ("from the right", 1, 2))  # name, axis across, axis up
_MAP_SIZE = 420.0  # pixels of the longer side
_MARGIN = 14.0
_MOST_EDGES = 3000
_FLAT = 0.999  # cosine between neighbours above which an edge is not drawn
_WORST = 12  # points listed


@dataclass(frozen=True)
class KindOfPoints:
    """What was found at N points of one kind. Errors are relative to the reference's RMS (core/measures.py)."""

    name: str
    positions: np.ndarray  # (N, 3) world metres
    errors: np.ndarray  # (N,)
    biases: np.ndarray  # (N,) signed
    figures: ErrorFigures
    floor: ErrorFigures
    trilinear: ErrorFigures | None
    noise: float
    negative: NegativeValues
    negative_floor: NegativeValues


def errors_html(
    title: str,
    facts: list[str],
    kinds: list[KindOfPoints],
    grid: Grid,
    edges: np.ndarray,
    bands: int,
    warnings: list[str],
) -> str:
    """The page. ``edges`` (M, 2, 3) are drawn as the scene's outlines, see ``outlines``."""
    listed = "".join(f"<li>{escape(warning)}</li>" for warning in warnings)
    return page(
        title,
        [
            page_header(title, facts),
            _cards(kinds),
            f'<section><h2>Warnings</h2><div class="box warnings"><ul>{listed}</ul></div></section>' if listed else "",
            f'<section><h2>Error of irradiance</h2><div class="box">{_table(kinds, bands)}</div></section>',
            *(_maps(kind, grid, edges) for kind in kinds),
            f'<section><h2>Worst points</h2><div class="box">{_worst(kinds)}</div></section>',
        ],
    )


def outlines(snapshot: SceneSnapshot) -> np.ndarray:
    """(M, 2, 3) edges of ``snapshot`` that a drawing needs, world metres: those of open surfaces and between faces that
    meet at an angle, the longest first where there are too many."""
    vertices, vertex = np.unique(snapshot.vertices[snapshot.triangles].reshape(-1, 3), axis=0, return_inverse=True)
    triangles = vertex.reshape(-1, 3)
    corners = vertices[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    ends = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    normal = np.tile(normal, (3, 1))
    pairs, edge, uses = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
    sums = np.zeros((len(pairs), 3))
    np.add.at(sums, edge.ravel(), normal)
    # Of two flat neighbours the normals add up to twice their length, whichever way the edge runs.
    flat = (uses == 2) & (np.linalg.norm(sums, axis=1) > 2 * np.sqrt((1 + _FLAT) / 2))
    drawn = vertices[pairs[~flat]]
    order = np.argsort(-np.linalg.norm(drawn[:, 1] - drawn[:, 0], axis=1), kind="stable")
    return drawn[order[:_MOST_EDGES]]


def _percent(value: float, signed: bool = False) -> str:
    return f"{100 * value:{'+' if signed else ''}.2f}"


def _cards(kinds: list[KindOfPoints]) -> str:
    cards = "".join(
        f'<div class="card"><b>{_percent(kind.figures.relative_rms)} %</b>'
        f"<span>error at {kind.figures.points} {escape(kind.name)}; "
        f"the bands allow {_percent(kind.floor.relative_rms)} %</span></div>"
        for kind in kinds
    )
    return f'<section class="cards">{cards}</section>'


def _table(kinds: list[KindOfPoints], bands: int) -> str:
    with_trilinear = any(kind.trilinear for kind in kinds)
    heads = ["", "points", "relative RMS", "bias", "95th", "worst", "noise", f"floor, {bands} bands"]
    heads += ["trilinear"] * with_trilinear + ["below zero", "of the basis"]
    rows = []
    for kind in kinds:
        figures = kind.figures
        values = [str(figures.points), _percent(figures.relative_rms), _percent(figures.bias, True)]
        values += [_percent(value) for value in (figures.percentile_95, figures.worst, kind.noise)]
        values += [
            _percent(row.relative_rms) if row else "" for row in (kind.floor, kind.trilinear)[: 1 + with_trilinear]
        ]
        values += [f"{part.count} of {part.values}" for part in (kind.negative, kind.negative_floor)]
        rows.append(f"<tr><th>{escape(kind.name)}</th>{''.join(f'<td>{value}</td>' for value in values)}</tr>")
    notes = [
        "In % of the RMS of the reference. Noise is the reference's own.",
        "Floor: a perfect probe standing at the point itself.",
        *["Trilinear: perfect probes at the nodes, plain trilinear lookup."] * with_trilinear,
        "Below zero: values of irradiance that the series made negative, and how many a perfect probe would.",
    ]
    return (
        f'<div style="overflow-x:auto"><table><tr>{"".join(f"<th>{head}</th>" for head in heads)}</tr>'
        f'{"".join(rows)}</table></div><p class="legend">{" ".join(notes)}</p>'
    )


def _maps(kind: KindOfPoints, grid: Grid, edges: np.ndarray) -> str:
    limit = max(float(np.percentile(kind.errors, 95)), 1e-4)
    views = "".join(
        f'<div class="box"><h3>{name}</h3>{_map(kind, grid, edges, across, up, limit, name)}</div>'
        for name, across, up in _VIEWS
    )
    scale = "".join(
        f'<span><i style="background:{_colour(share)}"></i>{_percent(share * limit, True)} %</span>'
        for share in (-1.0, -0.5, 0.0, 0.5, 1.0)
    )
    return (
        f"<section><h2>Where the error is: {escape(kind.name)}</h2>"
        f'<p class="legend">Colour is bias, size is error; the ring marks the worst point. {scale}</p>'
        f'<div class="pair">{views}'
        f'<div class="box"><h3>How many</h3>{histogram(100 * kind.errors, f"Errors of {kind.name}", "%")}</div></div>'
        "</section>"
    )


def _map(kind: KindOfPoints, grid: Grid, edges: np.ndarray, across: int, up: int, limit: float, name: str) -> str:
    """Parallel projection of the volume, what is near it of the scene, and the points, which tell their values."""
    box = np.array([[x, y, z, 1.0] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) @ grid.matrix.T[:, :3]
    axes = [across, up]
    known = np.concatenate([box, kind.positions])[:, axes]
    low, high = known.min(axis=0), known.max(axis=0)
    pad = 0.06 * max(high - low)
    low, high = low - pad, high + pad
    scale = _MAP_SIZE / max(high - low)
    width, height = (high - low) * scale + 2 * _MARGIN

    def place(points):
        flat = (points[..., axes] - low) * scale
        return np.stack([flat[..., 0] + _MARGIN, height - _MARGIN - flat[..., 1]], axis=-1)

    label = f"{kind.name} {name}"
    parts = [f'<svg viewBox="0 0 {width:.0f} {height:.0f}" role="img" aria-label="{escape(label, quote=True)}">']
    shown = edges[((edges[..., axes].max(axis=1) >= low) & (edges[..., axes].min(axis=1) <= high)).all(axis=1)]
    drawn = "".join(f"M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}" for (x0, y0), (x1, y1) in place(shown).tolist())
    parts.append(f'<path class="grid" d="{drawn}" style="fill:none;stroke:var(--hatch)"/>')
    sides = [(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in (1, 2, 4)]
    frame = place(box)
    drawn = "".join(f"M{frame[a][0]:.1f} {frame[a][1]:.1f}L{frame[b][0]:.1f} {frame[b][1]:.1f}" for a, b in sides)
    parts.append(f'<path d="{drawn}" style="fill:none;stroke:var(--soft);stroke-dasharray:3 4"/>')
    at = place(kind.positions)
    for row in np.argsort(kind.errors):
        share = float(kind.biases[row] / limit)
        radius = 2.5 + 4.5 * min(float(kind.errors[row]) / limit, 1.5)
        where = ", ".join(number(value) for value in kind.positions[row])
        parts.append(
            f'<circle cx="{at[row, 0]:.1f}" cy="{at[row, 1]:.1f}" r="{radius:.1f}" style="fill:{_colour(share)};'
            f'stroke:var(--ink);stroke-width:.5"><title>({where}) m: error {_percent(kind.errors[row])} %, bias '
            f"{_percent(kind.biases[row], True)} %</title></circle>"
        )
    worst = at[kind.figures.worst_index]
    parts.append(
        f'<circle cx="{worst[0]:.1f}" cy="{worst[1]:.1f}" r="13" style="fill:none;stroke:var(--bad);stroke-width:2"/>'
    )
    return "".join(parts) + "</svg>"


def _colour(share: float) -> str:
    """Blue where too dark, red where too bright, white between; ``share`` −1..1."""
    amount = min(abs(share), 1.0)
    end = np.array([197, 43, 35]) if share > 0 else np.array([33, 92, 184])
    r, g, b = (np.array([245, 245, 245]) * (1 - amount) + end * amount).round().astype(int)
    return f"rgb({r} {g} {b})"


def _worst(kinds: list[KindOfPoints]) -> str:
    found = [(float(kind.errors[row]), kind, row) for kind in kinds for row in range(len(kind.errors))]
    found.sort(key=lambda entry: -entry[0])
    rows = "".join(
        f"<tr><th>{escape(kind.name)}</th><td>{', '.join(number(value) for value in kind.positions[row])}</td>"
        f"<td>{_percent(error)}</td><td>{_percent(kind.biases[row], True)}</td></tr>"
        for error, kind, row in found[:_WORST]
    )
    return f"<table><tr><th></th><th>position, m</th><th>error, %</th><th>bias, %</th></tr>{rows}</table>"
