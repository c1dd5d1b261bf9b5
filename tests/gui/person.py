# SPDX-License-Identifier: GPL-3.0-or-later
"""A person in front of Blender: eyes (pictures, text on the screen) and hands (mouse, keys, operators).

Screen coordinates have their origin at the top left, as X has them; Blender's own have it at the bottom left.
"""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy
import leaks
import numpy as np

EXTENSION = "bl_ext.user_default.gridlight"
READING_SCALE = 3  # letters of the interface are 8 to 11 pixels high; text recognition wants about 30
# Grey levels that become white and black for reading: of bright letters on anything, of dim ones on dark ground.
LEVELS = ("45%,85%", "20%,75%")
LOOKS = 12  # at the screen before a person gives up looking for something
CLOSED_PIXELS = 8  # regions that are closed are this wide at most
REACTION_SECONDS = 0.25  # between a click and what it shows
LAST_TIMER_SECONDS = 8.0  # a file's light is compared with its scene a moment after the last edit


@dataclass(frozen=True)
class Rectangle:
    """Pixels of the screen, origin top left."""

    x: int
    y: int
    width: int
    height: int

    @property
    def center(self) -> tuple[int, int]:
        return self.x + self.width // 2, self.y + self.height // 2


class Person:
    """Plays one scenario. ``clicks`` counts what the person did with the mouse."""

    def __init__(self, scenario: str):
        self._scenario = scenario
        self._handlers = leaks.application_handlers(EXTENSION)
        self._on_gpu = leaks.gpu_objects()
        self._open_panels = ["Volume", "Bake", "Preview", "Export"]
        self.clicks = 0

    # Blender's side
    # ------------------------------------------------------------------------------------------------------------------

    def module(self, name: str = ""):
        """A module of the installed extension, ``module("bake.job")``; its root without a name."""
        import importlib

        return importlib.import_module(f"{EXTENSION}.{name}" if name else EXTENSION)

    @property
    def window(self) -> bpy.types.Window:
        return bpy.context.window_manager.windows[0]

    def area(self, kind: str = "VIEW_3D") -> bpy.types.Area:
        """The largest area of its kind."""
        areas = [area for area in self.window.screen.areas if area.type == kind]
        return max(areas, key=lambda area: area.width * area.height)

    def region(self, kind: str = "WINDOW", area: bpy.types.Area | None = None) -> bpy.types.Region:
        area = area or self.area()
        return next(region for region in area.regions if region.type == kind)

    @contextlib.contextmanager
    def at_viewport(self) -> Iterator[None]:
        """``bpy.ops`` as if called with the mouse over the 3D viewport."""
        area = self.area()
        with bpy.context.temp_override(window=self.window, area=area, region=self.region("WINDOW", area)):
            yield

    def do(self, operator: str, invoke: bool = False, **options) -> set[str]:
        """Calls an operator over the 3D viewport, ``do("gridlight.bake", invoke=True)`` as a button would."""
        module, name = operator.split(".")
        call = getattr(getattr(bpy.ops, module), name)
        with self.at_viewport():
            if invoke:
                return call("INVOKE_DEFAULT", **options)
            return call("EXEC_DEFAULT", True, **options)  # True: an undo step, as from the interface

    def show_sidebar(self, category: str | None = "Gridlight") -> None:
        """Opens the 3D viewport's sidebar at a tab, wide enough to read."""
        area = self.area()
        area.spaces.active.show_region_ui = True
        area.tag_redraw()
        self._category = category

    def open_tab(self, category: str = "Gridlight") -> Iterator[float]:
        """Opens the sidebar and brings its tab ``category`` to the front."""
        self.show_sidebar()
        yield REACTION_SECONDS
        self.region("UI").active_panel_category = category
        self.area().tag_redraw()
        yield REACTION_SECONDS

    # Eyes
    # ------------------------------------------------------------------------------------------------------------------

    def look(self, rectangle: Rectangle | None = None) -> np.ndarray:
        """What the screen shows, (height, width, 3) uint8 sRGB, row 0 at the top."""
        raw = _grab(rectangle)
        header = re.match(rb"P6\s+(\d+)\s+(\d+)\s+255\s", raw)
        width, height = int(header[1]), int(header[2])
        return np.frombuffer(raw, np.uint8, offset=header.end()).reshape(height, width, 3)

    def picture(self, name: str, rectangle: Rectangle | None = None) -> Path:
        """Keeps what the screen shows as ``<scenario>-<name>.png`` among the test's pictures."""
        path = Path(os.environ["GRIDLIGHT_PICTURES"]) / f"{self._scenario}-{name}.png"
        _pipe(["convert", "ppm:-", str(path)], _grab(rectangle))
        return path

    def rectangle(self, region: bpy.types.Region | None = None) -> Rectangle:
        """Where a region is on the screen; by default the 3D viewport's."""
        region = region or self.region()
        return Rectangle(region.x, self.window.height - region.y - region.height, region.width, region.height)

    def read(self, rectangle: Rectangle, levels: str = LEVELS[0]) -> list[tuple[str, Rectangle]]:
        """Words on the screen and where they stand, in reading order."""
        enlarge = ["-colorspace", "gray", "-level", levels, "-negate", "-resize", f"{100 * READING_SCALE}%"]
        image = _pipe(["convert", "ppm:-", *enlarge, "png:-"], _grab(rectangle))
        reading = ["tesseract", "-", "-", "--psm", "11", "--dpi", "300", "tsv"]
        # With two threads it takes four times the processor time: they wait for each other by spinning.
        lines = _pipe(reading, image, OMP_THREAD_LIMIT="1").decode().splitlines()[1:]
        words = []
        for line in lines:
            fields = line.split("\t")
            if len(fields) == 12 and fields[11].strip():
                x, y, width, height = (int(value) // READING_SCALE for value in fields[6:10])
                words.append((fields[11].strip(), Rectangle(rectangle.x + x, rectangle.y + y, width, height)))
        return words

    def find(self, text: str, rectangle: Rectangle) -> Rectangle | None:
        """Where the words of ``text`` stand in a row on the screen."""
        wanted = text.split()
        for levels in LEVELS:
            words = self.read(rectangle, levels)
            for start in range(len(words) - len(wanted) + 1):
                row = words[start : start + len(wanted)]
                if all(_alike(word, seen) for word, (seen, _) in zip(wanted, row)):
                    first, last = row[0][1], row[-1][1]
                    return Rectangle(first.x, first.y, last.x + last.width - first.x, first.height)
        return None

    def below(self, text: str) -> Iterator[float]:
        """Looks for ``text`` in the sidebar; returns the sidebar from below it on: titles of panels often say the same
        as buttons in them."""
        place = yield from self._search(text, self._sidebar)
        sidebar, top = self._sidebar(), place.y + place.height + 4
        return Rectangle(sidebar.x, top, sidebar.width, sidebar.y + sidebar.height - top)

    def _sidebar(self) -> Rectangle:
        return self.rectangle(self.region("UI"))

    def _search(self, text: str, where: Callable[[], Rectangle]) -> Iterator[float]:
        """Looks again and again until ``text`` is found; returns where it stands. ``where`` is asked at every look:
        regions open and grow meanwhile."""
        for _ in range(LOOKS):
            rectangle = where()
            place = self.find(text, rectangle) if rectangle.width > CLOSED_PIXELS else None
            if place is not None:
                return place
            yield 2 * REACTION_SECONDS
        self.picture("unread")
        seen = " ".join(word for word, _ in self.read(rectangle))
        raise AssertionError(f"'{text}' is not on the screen at {rectangle}; what is: {seen}")

    # Hands
    # ------------------------------------------------------------------------------------------------------------------

    def move(self, x: int, y: int) -> None:
        subprocess.run(["xdotool", "mousemove", str(x), str(y)], check=True)

    def click(self, x: int, y: int, button: int = 1) -> Iterator[float]:
        """Moves there and clicks, with a moment for Blender to notice each."""
        self.clicks += 1
        # Blender takes no notice of a button when the mouse has not moved a little before.
        self.move(x - 1, y)
        yield REACTION_SECONDS / 2
        self.move(x, y)
        yield REACTION_SECONDS / 2
        subprocess.run(["xdotool", "click", str(button)], check=True)
        yield REACTION_SECONDS
        yield from self.settle()

    def settle(self) -> Iterator[float]:
        """Waits until the sidebar stands still: panels open and close in motion."""
        before = None
        for _ in range(LOOKS // 2):
            seen = self.look(self.rectangle(self.region("UI")))
            if before is not None and seen.shape == before.shape and (seen == before).all():
                return
            before = seen
            yield REACTION_SECONDS

    def click_text(self, text: str, rectangle: Rectangle | None = None) -> Iterator[float]:
        """Reads the screen until ``text`` is found and clicks it. By default in the 3D viewport's sidebar."""
        place = yield from self._search(text, (lambda: rectangle) if rectangle else self._sidebar)
        yield from self.click(*place.center)

    def only_panel(self, title: str) -> Iterator[float]:
        """Opens the sidebar's panel ``title`` and closes all others, by clicks on their titles."""
        for other in [name for name in self._open_panels if name != title]:
            yield from self.click_text(other)
        if title not in self._open_panels:
            yield from self.click_text(title)
        self._open_panels = [title]

    def scroll(self, lines: int, rectangle: Rectangle | None = None) -> Iterator[float]:
        """Turns the wheel over a part of the screen, by default the sidebar; positive: down."""
        self.move(*(rectangle or self.rectangle(self.region("UI"))).center)
        yield REACTION_SECONDS
        for _ in range(abs(lines)):
            subprocess.run(["xdotool", "click", "5" if lines > 0 else "4"], check=True)
            yield REACTION_SECONDS / 4
        yield REACTION_SECONDS

    def key(self, *keys: str) -> Iterator[float]:
        """Presses keys by their X names, "Escape" or "ctrl+z", with the mouse over the 3D viewport."""
        self.move(*self.rectangle().center)
        yield REACTION_SECONDS / 2
        for key in keys:
            subprocess.run(["xdotool", "key", key], check=True)
            yield REACTION_SECONDS

    def hold(self, key: str, seconds: float) -> Iterator[float]:
        """Holds a key down."""
        self.move(*self.rectangle().center)
        yield REACTION_SECONDS / 2
        subprocess.run(["xdotool", "keydown", key], check=True)
        yield seconds
        subprocess.run(["xdotool", "keyup", key], check=True)
        yield REACTION_SECONDS

    def wait_until(self, condition, what: str, seconds: float = 30.0, step: float = 0.1) -> Iterator[float]:
        """Waits until ``condition()`` holds."""
        waited = 0.0
        while not condition():
            if waited > seconds:
                raise AssertionError(f"waited {seconds:.0f} s in vain for {what}")
            waited += step
            yield step

    # Afterwards
    # ------------------------------------------------------------------------------------------------------------------

    def check_nothing_runs(self) -> Iterator[float]:
        """No handler more than before; no timer, drawing or operator is left. What ends by itself has a moment to."""
        waited = 0.0
        while timers := leaks.timers(EXTENSION):
            assert waited < LAST_TIMER_SECONDS, f"timers left: {timers}"
            waited += REACTION_SECONDS
            yield REACTION_SECONDS
        handlers = leaks.application_handlers(EXTENSION)
        assert handlers == self._handlers, f"handlers before: {self._handlers}, now: {handlers}"
        drawing = leaks.draw_handlers(EXTENSION)
        assert not drawing, f"draw handlers left: {drawing}"
        running = [
            operator.bl_idname
            for window in bpy.context.window_manager.windows
            for operator in window.modal_operators
            if operator and operator.bl_idname.startswith("GRIDLIGHT_")  # None: of a class that is gone
        ]
        assert not running, f"operators left: {running}"
        for _ in range(LOOKS):  # tooltips have timers too, which end by themselves
            heard = yield from leaks.event_timers()
            if not heard:
                return
        raise AssertionError(f"a window's timer is left: it sent {heard} events")

    def check_nothing_is_held(self) -> None:
        """On the GPU, for Python, no more than before. Bakes are kept as long as their file: ask after another is
        loaded."""
        grown = leaks.gpu_objects() - self._on_gpu
        assert not grown, f"left on the GPU: {grown}"


def _grab(rectangle: Rectangle | None) -> bytes:
    """The screen or a part of it as a binary PPM file."""
    command = ["import", "-silent", "-window", "root", "-depth", "8"]
    if rectangle:
        command += ["-crop", f"{rectangle.width}x{rectangle.height}+{rectangle.x}+{rectangle.y}", "+repage"]
    return _pipe([*command, "ppm:-"], b"")


def _pipe(command: list[str], data: bytes, **environment: str) -> bytes:
    """What ``command`` writes when it is given ``data``."""
    return subprocess.run(command, input=data, capture_output=True, check=True, env=os.environ | environment).stdout


def _alike(wanted: str, seen: str) -> bool:
    """Equal but for what surrounds a word: arrows and check boxes are read as letters beside it."""
    return wanted.casefold() == seen.strip("|[](){}<>.,:;'\"“”‘’«»_-=~*°").casefold()
