# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress on standard error: phase, rate and time left, in place on a terminal, as sparse lines elsewhere."""

from __future__ import annotations

import shutil
import sys
import time

TERMINAL_INTERVAL = 0.1  # seconds between redraws
LINE_INTERVAL = 5.0  # seconds between lines where nothing can be redrawn


class Reporter:
    """Receives what a job says about itself.

    A job calls ``phase`` when a new kind of work starts, ``advance`` as it goes, ``note`` for facts worth reading and
    ``warn`` for what the user should act on. ``quiet`` silences all but warnings. Every warning is kept, once, in
    ``warnings``. ``result`` takes text that belongs on standard output, above the JSON; it is kept in ``results``.
    """

    def __init__(self, stream=None, quiet: bool = False, clock=time.monotonic):
        self.warnings: list[str] = []
        self.results: list[str] = []
        self._stream = sys.stderr if stream is None else stream
        self._quiet = quiet
        self._clock = clock
        self._in_place = self._stream.isatty()
        self._name = ""
        self._total: int | None = None
        self._done = 0
        self._started = self._shown = self._clock()
        self._drawn = 0  # characters standing in the terminal's current line

    def phase(self, name: str, total: int | None = None) -> None:
        """Starts the phase ``name`` of ``total`` steps; None: unknown."""
        self.finish()
        self._name, self._total, self._done = name, total, 0
        self._started = self._clock()
        self._shown = -1e9 if self._in_place else self._started
        if self._in_place:
            self._show()

    def advance(self, count: int = 1) -> None:
        """``count`` more steps of the phase are done."""
        self._done += count
        interval = TERMINAL_INTERVAL if self._in_place else LINE_INTERVAL
        if self._clock() - self._shown >= interval:
            self._show()

    def note(self, text: str) -> None:
        if not self._quiet:
            self._line(text)

    def warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)
            self._line(f"warning: {text}")

    def result(self, text: str) -> None:
        self.results.append(text)

    def finish(self) -> None:
        """Ends the running phase with its last figures."""
        if self._name:
            seconds = self._clock() - self._started
            summary = f"{self._name}: {_seconds(seconds)}"
            if self._done and seconds > 0:
                summary += f", {_count(self._done)} at {_count(self._done / seconds)}/s"
            if not self._quiet:
                self._line(summary)
            self._name = ""

    def abandon(self) -> None:
        """Ends the running phase without a word: what follows is an error or the user's own stop."""
        self._name = ""
        if self._drawn:
            self._stream.write("\r" + " " * self._drawn + "\r")
            self._stream.flush()
            self._drawn = 0

    def _show(self) -> None:
        if self._quiet or not self._name:
            return
        now = self._clock()
        self._shown = now
        seconds = now - self._started
        text = self._name
        if self._total:
            text += f" {_count(self._done)}/{_count(self._total)} ({100 * self._done // self._total} %)"
        elif self._done:
            text += f" {_count(self._done)}"
        if self._done and seconds > 0.2:
            rate = self._done / seconds
            text += f", {_count(rate)}/s"
            if self._total and self._done < self._total:
                text += f", {_seconds((self._total - self._done) / rate)} left"
        if self._in_place:
            text = text[: shutil.get_terminal_size().columns - 1]
            self._stream.write("\r" + text.ljust(self._drawn))
            self._drawn = len(text)
        else:
            self._stream.write(text + "\n")
        self._stream.flush()

    def _line(self, text: str) -> None:
        erase = "\r" + " " * self._drawn + "\r" if self._drawn else ""
        self._drawn = 0
        self._stream.write(f"{erase}{text}\n")
        self._stream.flush()


def _seconds(value: float) -> str:
    if value < 60:
        return f"{value:.1f} s"
    minutes, seconds = divmod(int(round(value)), 60)
    if minutes < 60:
        return f"{minutes} min {seconds:02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"


def _count(value: float) -> str:
    if value >= 1e6:
        return f"{value / 1e6:.3g} M"
    if value >= 1e4:
        return f"{value / 1e3:.3g} k"
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"
