# SPDX-License-Identifier: GPL-3.0-or-later
"""Words over the view in Explore mode: the keys, and what the last one did."""

from __future__ import annotations

import time

import bpy

from .hud import rectangle, write

HELP = (
    ("W A S D, arrows", "walk; Shift runs"),
    ("Q, E", "down, up"),
    ("Mouse", "look"),
    ("Space", "frame rate"),
    ("F1", "this help"),
    ("F9", "screenshot to a file"),
    ("−  +", "wall colour"),
    ("1  2", "ceiling lights 1: darker, brighter"),
    ("3  4", "ceiling lights 2"),
    ("5  6", "wall lights"),
    ("7  8", "moving light"),
    ("9", "animation"),
    ("Page Up, Page Down", "exposure"),
    ("P", "probes"),
    ("Esc", "leave"),
)
_SHOWN_SECONDS = 2.5
_PANEL = (0.05, 0.05, 0.06, 0.82)
_KEY_COLOR = (1.0, 0.78, 0.35, 1.0)
_LINE, _KEY_WIDTH, _WIDTH, _PAD = 19, 170, 420, 14


class ExploreOverlay:
    """``say`` shows a line for some seconds, ``help_is_open`` the list of keys."""

    def __init__(self):
        self.help_is_open = False
        self._text = ""
        self._until = 0.0

    def say(self, text: str) -> None:
        self._text = text
        self._until = time.monotonic() + _SHOWN_SECONDS

    @property
    def is_fading(self) -> bool:
        """Whether a line has to vanish some time soon."""
        return bool(self._text)

    def draw(self) -> None:
        """POST_PIXEL: into the region of the context."""
        context = bpy.context
        scale = context.preferences.system.ui_scale
        width, height = context.region.width, context.region.height
        if time.monotonic() > self._until:
            self._text = ""
        if self.help_is_open:
            self._draw_help(width, height, scale)
        line = self._text or ("" if self.help_is_open else "F1: help   Esc: leave")
        write(line, width / 2 - 3.2 * len(line) * scale, 44 * scale, scale)

    @staticmethod
    def _draw_help(width: float, height: float, scale: float) -> None:
        # A small window gets smaller letters rather than half the list.
        scale *= min(1.0, height / ((_LINE * len(HELP) + 4 * _PAD) * scale), width / (_WIDTH * scale))
        full = (_LINE * (len(HELP) + 1) + 2 * _PAD) * scale
        left, bottom = (width - _WIDTH * scale) / 2, (height - full) / 2
        rectangle(left, bottom, left + _WIDTH * scale, bottom + full, _PANEL)
        top = bottom + full - (_PAD + 0.8 * _LINE) * scale
        write("Explore", left + _PAD * scale, top, scale, size=14)
        for row, (key, meaning) in enumerate(HELP, 1):
            y = top - row * _LINE * scale
            write(key, left + _PAD * scale, y, scale, _KEY_COLOR)
            write(meaning, left + (_PAD + _KEY_WIDTH) * scale, y, scale)
