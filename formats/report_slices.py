# SPDX-License-Identifier: GPL-3.0-or-later
"""Slices through a field as pictures: one pixel per probe, one slice per level of the grid.

All levels of a quantity lie below each other in one PNG, and the page shows one by shifting it. Culled probes are
transparent, so that the hatching of the page shows through; invalid probes have a colour that the scale does not use.
"""

from __future__ import annotations

import base64
import struct
import zlib
from dataclasses import dataclass
from html import escape

import numpy as np

from ..core.conventions import ACTIVE, CULLED, INVALID, LUMINANCE
from ..core.field import Field
from ..core.probe_states import CULLED_MEANS, invalid_counts, invalid_in_words
from ..core.spherical_harmonics import Y0, irradiance
from .report_figures import number

INVALID_COLOUR = (214, 48, 90)
_STATE_COLOURS = {CULLED: (0, 0, 0, 0), ACTIVE: (64, 160, 110, 255), INVALID: (*INVALID_COLOUR, 255)}
_HOVER_LIMIT = 20_000  # probes whose values travel in the page for reading them under the pointer
_OVERVIEW_LIMIT = 24  # levels shown side by side

# Dark violet to yellow with even steps of lightness, sRGB.
_SCALE = np.array(
    [
        (68, 1, 84),
        (72, 40, 120),
        (62, 74, 137),
        (49, 104, 142),
        (38, 130, 142),
        (31, 158, 137),
        (53, 183, 121),
        (109, 205, 89),
        (180, 222, 44),
        (253, 231, 37),
    ],
    float,
)


@dataclass
class Quantity:
    """Something to show per probe: ``values`` (P,), or ``colours`` (P, 4) uint8 that need no scale."""

    key: str
    title: str
    unit: str
    values: np.ndarray | None = None
    colours: np.ndarray | None = None


def quantities(field: Field) -> list[Quantity]:
    """What the report shows of ``field``."""
    up = np.maximum(irradiance(field.coefficients, np.array([0.0, 0.0, 1.0])), 0)
    mean = field.coefficients[:, 0] * Y0
    return [
        Quantity("up", "Irradiance of a surface that faces up", "W/m²", values=up @ LUMINANCE),
        Quantity("mean", "Mean radiance from all sides", "W/(m² sr)", values=mean @ LUMINANCE),
        Quantity("colour", "Colour of the light from all sides", "", colours=_picture_colours(mean, field.state)),
        Quantity("state", "State of the probes", "", colours=_state_colours(field.state)),
    ]


def slices_html(field: Field, block: str) -> str:
    """A figure with tabs for the quantities, a slider over the levels and all levels as small multiples.

    ``block`` makes the ids of this volume unique in the page.
    """
    nx, ny, nz = field.grid.resolution
    tabs, panels = [], []
    for index, quantity in enumerate(quantities(field)):
        tab = f"{block}-{quantity.key}"
        checked = " checked" if index == 0 else ""
        tabs.append(
            f'<input type="radio" name="{block}" id="{tab}" value="{quantity.key}"{checked}>'
            f'<label for="{tab}">{escape(quantity.title)}</label>'
        )
        panels.append(_panel(field, quantity, index == 0))
    level = nz // 2
    heights = _level_heights(field)
    slider = (
        (
            f'<label class="level">Level <input type="range" min="0" max="{nz - 1}" value="{level}" '
            f'data-heights="{escape(",".join(heights), quote=True)}"><output></output></label>'
        )
        if nz > 1
        else ""
    )
    return (
        f'<div class="slices" data-nx="{nx}" data-ny="{ny}" data-nz="{nz}" style="--aspect:{_aspect(field)}">'
        f'<div class="tabs">{"".join(tabs)}</div>{slider}{"".join(panels)}</div>'
    )


def _panel(field: Field, quantity: Quantity, shown: bool) -> str:
    nz = field.grid.resolution[2]
    if quantity.colours is not None:
        colours, scale, hover = quantity.colours, _legend_states(field) if quantity.key == "state" else "", ""
        if quantity.key == "colour":
            scale = '<p class="legend">brightest probe at white, sRGB</p>'
    else:
        colours, scale = _false_colours(quantity, field.state)
        hover = ""
        if field.grid.count <= _HOVER_LIMIT:
            packed = base64.b64encode(np.asarray(quantity.values, "<f4").tobytes()).decode()
            hover = f' data-values="{packed}" data-unit="{escape(quantity.unit, quote=True)}"'
    atlas = base64.b64encode(png(_atlas(colours, field.grid.resolution))).decode()
    every = -(-nz // _OVERVIEW_LIMIT)
    small = "".join(
        f'<figure><div class="slice" style="{_shift(level, nz)}"></div><figcaption>{level}</figcaption></figure>'
        for level in range(0, nz, every)
    )
    overview = f'<div class="multiples">{small}</div>' if nz > 1 else ""
    return (
        f'<div class="panel" data-key="{quantity.key}" style="--atlas:url(data:image/png;base64,{atlas});--levels:{nz}"'
        f"{'' if shown else ' hidden'}{hover}>"
        f'<div class="slice large" style="{_shift(nz // 2, nz)}"></div>'
        f'<p class="readout">&nbsp;</p>{scale}{overview}</div>'
    )


def _false_colours(quantity: Quantity, state: np.ndarray) -> tuple[np.ndarray, str]:
    """((P, 4) uint8, legend): a linear scale, or a logarithmic one where a few bright probes would hide the rest."""
    values = np.asarray(quantity.values, float)
    lit = values[(state == ACTIVE) & np.isfinite(values)]
    low, middle, high = np.percentile(lit, (1, 50, 99)) if len(lit) else (0.0, 0.5, 1.0)
    if high <= 0:
        low, middle, high = 0.0, 0.5, 1.0
    logarithmic = high > 8 * max(middle, 1e-12)
    if logarithmic:
        low = max(low, high * 1e-4)
        position = np.log(np.maximum(values, low) / low) / np.log(high / low)
        ticks = np.geomspace(low, high, 5)
    else:
        position = values / high
        ticks = np.linspace(0, high, 5)
    place = np.clip(np.nan_to_num(position), 0, 1) * (len(_SCALE) - 1)
    start = np.minimum(place.astype(int), len(_SCALE) - 2)
    rgb = _SCALE[start] + (_SCALE[start + 1] - _SCALE[start]) * (place - start)[:, None]
    stops = ",".join(f"rgb({r:.0f} {g:.0f} {b:.0f})" for r, g, b in _SCALE)
    labels = "".join(f"<span>{number(tick)}</span>" for tick in ticks)
    kind = "logarithmic" if logarithmic else "linear"
    legend = (
        f'<div class="scale"><i style="background:linear-gradient(90deg,{stops})"></i><div>{labels}</div>'
        f"<p>{escape(quantity.unit)}, {kind}; the brightest hundredth is clipped</p></div>"
    )
    return _with_states(rgb, state), legend


def _picture_colours(radiance: np.ndarray, state: np.ndarray) -> np.ndarray:
    """(P, 4) uint8 sRGB of linear ``radiance`` (P, 3), exposed so that the 99th percentile is white."""
    radiance = np.maximum(np.nan_to_num(np.asarray(radiance, float)), 0)
    lit = radiance[state == ACTIVE].max(axis=1) if (state == ACTIVE).any() else np.ones(1)
    linear = np.clip(radiance / (np.percentile(lit, 99) or 1.0), 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055)
    return _with_states(encoded * 255, state)


def _with_states(rgb: np.ndarray, state: np.ndarray) -> np.ndarray:
    """(P, 4) uint8: ``rgb`` (P, 3) 0..255 for active probes, the marks of the others."""
    colours = np.empty((len(rgb), 4), np.uint8)
    colours[:, :3] = np.clip(rgb + 0.5, 0, 255)
    colours[:, 3] = 255
    for mark in (CULLED, INVALID):
        colours[state == mark] = _STATE_COLOURS[mark]
    return colours


def _state_colours(state: np.ndarray) -> np.ndarray:
    colours = np.empty((len(state), 4), np.uint8)
    for mark, colour in _STATE_COLOURS.items():
        colours[state == mark] = colour
    return colours


def _legend_states(field: Field) -> str:
    invalid = f"invalid: {invalid_in_words(invalid_counts([field]))}"
    names = (("active", "rgb(64 160 110)"), (invalid, f"rgb{INVALID_COLOUR}"))
    marks = "".join(f'<span><i style="background:{colour}"></i>{name}</span>' for name, colour in names)
    return f'<p class="legend">{marks}<span><i class="hatch"></i>{CULLED_MEANS}</span></p>'


def _atlas(colours: np.ndarray, resolution: tuple[int, int, int]) -> np.ndarray:
    """(nz·ny, nx, 4): levels below each other from the lowest, +y upwards in each."""
    nx, ny, nz = resolution
    return np.ascontiguousarray(colours.reshape(nz, ny, nx, 4)[:, ::-1].reshape(nz * ny, nx, 4))


def _shift(level: int, levels: int) -> str:
    return f"--at:{100 * level / max(levels - 1, 1):.4f}%"


def _aspect(field: Field) -> str:
    """Width to height of a slice as the box has it, within what can be looked at."""
    nx, ny, _ = field.grid.resolution
    cell_x, cell_y, _ = field.grid.cell_size()
    return f"{np.clip(nx * cell_x / (ny * cell_y), 0.2, 8):.4f}"


def _level_heights(field: Field) -> list[str]:
    """What the slider says at each level: the world height of its middle where the box stands upright."""
    nx, ny, nz = field.grid.resolution
    positions = field.grid.positions().reshape(nz, ny * nx, 3)
    if np.ptp(positions[..., 2], axis=1).max() > 1e-6 * max(1.0, np.abs(positions[..., 2]).max()):
        return [""] * nz
    return [f"z = {level:.2f} m" for level in positions[:, 0, 2]]


def png(pixels: np.ndarray) -> bytes:
    """An 8-bit RGBA PNG file of ``pixels`` (height, width, 4) uint8, row 0 at the top (ISO/IEC 15948)."""
    height, width = pixels.shape[:2]
    rows = np.zeros((height, 1 + 4 * width), np.uint8)  # every row starts with its filter: none
    rows[:, 1:] = pixels.reshape(height, -1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9))
        + chunk(b"IEND", b"")
    )
