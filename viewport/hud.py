# SPDX-License-Identifier: GPL-3.0-or-later
"""Words over the view: what is shown, how fast, how old the light is, and what colours of data modes mean."""

from __future__ import annotations

import blf
import bpy
import gpu
from gpu_extras.batch import batch_for_shader

from ..core.conventions import CULLED, INVALID
from ..core.field import Field
from ..core.probe_states import CULLED_MEANS, invalid_counts, invalid_in_words
from .sessions import SceneSession

_SIZE, _LEADING, _MARGIN = 12, 1.5, 16
_TEXT = (1.0, 1.0, 1.0, 0.95)
_SHADOW = (0.0, 0.0, 0.0, 0.8)
_OUTLINE = 6  # the kind of shadow
# As viewport_data_lib.glsl colours them.
HEAT = [(0.08, 0.1, 0.45), (0.1, 0.6, 0.85), (0.2, 0.75, 0.25), (0.95, 0.85, 0.15), (0.85, 0.1, 0.08)]
HEAT_END_PERCENT = 20
_FREE, _BEHIND, _INVALID, _CULLED = (0.2, 0.75, 0.3), (0.95, 0.5, 0.05), (0.8, 0.08, 0.1), (0.25, 0.35, 0.65)
_MARKS = {CULLED: (0.25, 0.25, 0.25), INVALID: (0.66, 0.15, 0.15)}  # spheres of probes that are not active


def draw(context: bpy.types.Context, session: SceneSession, preview) -> None:
    """Draws into the region of ``context``, in pixels."""
    scale = context.preferences.system.ui_scale
    left, bottom = _corner(context)
    line = _SIZE * _LEADING * scale
    for row, text in enumerate(reversed(lines(context, session, preview))):
        write(text, left, bottom + row * line, scale)
    if preview.mode == "ERROR":
        _heat_legend(left, bottom + 5 * line, scale)
    elif preview.mode == "VALIDITY":
        _legend(_states(session), left, bottom + 4 * line, line, scale)
    elif preview.show_probes:
        _legend(_marks(session), left, bottom + 4 * line, line, scale)


def lines(context: bpy.types.Context, session: SceneSession, preview) -> list[str]:
    """The readout, from top to bottom."""
    if session.message:
        return [f"Gridlight: {session.message}"]
    if session.gpu is None:
        return ["Gridlight: reading the scene"]
    shown = []
    if not session.gpu.fields:
        shown.append("Gridlight: no baked light yet, direct light alone")
    settings = context.scene.view_settings
    if settings.view_transform != "Standard" and preview.mode in ("FULL", "DIRECT", "INDIRECT", "IRRADIANCE"):
        shown.append(f"Colours: Standard; this scene renders with {settings.view_transform}")
    if preview.show_rate:
        shown.append(_rates(session))
    return shown


def _rates(session: SceneSession) -> str:
    readout = session.readout
    parts = [f"{readout.frames_per_second:.0f} frames/s" if readout.frames_per_second else "at rest"]
    if session.gpu.fields:
        if readout.probes_per_frame:
            parts.append(f"{readout.probes_per_frame} probes/frame")
        parts.append(f"light {readout.age_seconds:.1f} s old" if readout.age_seconds else "light up to date")
    return ", ".join(parts)


def write(text: str, x: float, y: float, scale: float, color=_TEXT, size: int = _SIZE) -> None:
    """One line of text with its left end at ``x``, its base line at ``y``, in pixels."""
    font = 0
    blf.size(font, size * scale)
    blf.enable(font, blf.SHADOW)
    blf.shadow(font, _OUTLINE, *_SHADOW)  # white ground is common: a soft shadow would not do
    blf.color(font, *color)
    blf.position(font, x, y, 0)
    blf.draw(font, text)
    blf.disable(font, blf.SHADOW)


def rectangle(left: float, bottom: float, right: float, top: float, color) -> None:
    """A filled rectangle, in pixels; ``color`` is RGBA as a display shows it."""
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    corners = [(left, bottom), (right, bottom), (right, top), (left, top)]
    batch = batch_for_shader(shader, "TRIS", {"pos": corners}, indices=[(0, 1, 2), (0, 2, 3)])
    shader.uniform_float("color", color)
    gpu.state.blend_set("ALPHA")
    batch.draw(shader)
    gpu.state.blend_set("NONE")


def _heat_legend(left: float, bottom: float, scale: float) -> None:
    width, height = 220 * scale, 10 * scale
    steps = 64
    for step in range(steps):
        place = step / (steps - 1) * (len(HEAT) - 1)
        index = min(int(place), len(HEAT) - 2)
        blend = place - index
        color = [a + (b - a) * blend for a, b in zip(HEAT[index], HEAT[index + 1])]
        rectangle(left + width * step / steps, bottom, left + width * (step + 1) / steps, bottom + height, (*color, 1))
    write("estimated error of a cell", left, bottom + 1.6 * height, scale)
    write("0 %", left, bottom - 1.5 * height, scale)
    write(f"{HEAT_END_PERCENT} % and more", left + 0.75 * width, bottom - 1.5 * height, scale)


def _states(session: SceneSession) -> list[tuple[tuple[float, float, float], str]]:
    """Colours of surface by the probes around it, and what they mean."""
    return [
        (_FREE, "sees free space"),
        (_BEHIND, "sees back faces"),
        (_INVALID, f"invalid: {_why_invalid(session)}"),
        (_CULLED, CULLED_MEANS),
    ]


def _marks(session: SceneSession) -> list[tuple[tuple[float, float, float], str]]:
    """Colours of spheres of probes that are not active, where there are such."""
    means = {CULLED: f"probe is {CULLED_MEANS}", INVALID: f"probe is invalid: {_why_invalid(session)}"}
    fields = _fields(session)
    return [(_MARKS[state], means[state]) for state in means if any((field.state == state).any() for field in fields)]


def _why_invalid(session: SceneSession) -> str:
    return invalid_in_words(invalid_counts(_fields(session)))


def _fields(session: SceneSession) -> list[Field]:
    return [item.field for item in session.gpu.fields.values()] if session.gpu else []


def _legend(
    entries: list[tuple[tuple[float, float, float], str]], left: float, bottom: float, line: float, scale
) -> None:
    for row, (color, meaning) in enumerate(reversed(entries)):
        y = bottom + row * line
        rectangle(left, y, left + 10 * scale, y + 10 * scale, (*color, 1))
        write(meaning, left + 18 * scale, y, scale)


def _corner(context: bpy.types.Context) -> tuple[float, float]:
    """Left bottom of what no other region covers, with a margin."""
    scale = context.preferences.system.ui_scale
    covered = 0
    if context.preferences.system.use_region_overlap:
        for region in context.area.regions:
            if region.type == "TOOLS" and region.alignment == "LEFT" and region.width > 1:
                covered = max(region.x + region.width - context.region.x, 0)
    return covered + _MARGIN * scale, _MARGIN * scale
