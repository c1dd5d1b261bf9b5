# SPDX-License-Identifier: GPL-3.0-or-later
"""How far a bake is, for a progress bar: receives what ``bake.job`` reports."""

from __future__ import annotations

import time

from ..core.settings import BakeSettings

# Phases in order, with the share of a volume's bake that each takes about.
_SHARES = {"read": 0.05, "upload": 0.15, "capture": 0.3, "light": 0.3, "project": 0.1, "gather": 0.4}
_TITLES = {
    "read": "Reading the scene",
    "upload": "Sending the scene",
    "capture": "Capturing",
    "light": "Bouncing light",
    "project": "Collecting light",
    "gather": "Gathering",
    "error": "Checking the error",
}
_TYPICAL_ITERATIONS = 8  # until light has settled; only the bar's speed hangs on it
_LEAST_SECONDS, _LEAST_SHARE = 1.0, 0.05  # before a guess of the time left is worth reading


class Progress:
    """A ``bake.job.Reporter`` that keeps figures instead of printing them."""

    def __init__(self, volumes: int, settings: BakeSettings):
        self.warnings: list[str] = []
        self.notes: list[str] = []
        self.name = ""
        self._volumes = volumes
        self._volume = 0
        self._unused = "project" if settings.gather else "gather"
        self._reached = 0.0
        self._iterations = None if settings.bounces is None else settings.bounces + 1
        self._phase = "read"
        self._done = 0
        self._total: int | None = None
        self._started = time.monotonic()

    def volume(self, name: str) -> None:
        """The next volume begins."""
        self.name = name
        self._volume += 1

    def phase(self, name: str, total: int | None = None) -> None:
        self._phase, self._done = name, 0
        self._total = self._iterations if name == "light" and total is None else total

    def advance(self, amount: int = 1) -> None:
        self._done += amount

    def note(self, text: str) -> None:
        self.notes.append(text)

    def warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)

    @property
    def phase_name(self) -> str:
        """As ``phase`` was told it."""
        return self._phase

    @property
    def share(self) -> float:
        """0 … 1 of the whole work, as far as it can be known. Never goes back."""
        shares = {name: share for name, share in _SHARES.items() if name != self._unused}
        names = list(shares)
        before = sum(shares[name] for name in names[: names.index(self._phase)]) if self._phase in shares else 0.0
        if self._total:
            within = min(self._done / self._total, 1.0)
        else:  # how many there will be is not known: the bar slows down
            within = 1.0 - 0.5 ** (2.0 * self._done / _TYPICAL_ITERATIONS)
        in_volume = (before + shares.get(self._phase, 0.0) * within) / sum(shares.values())
        self._reached = max(self._reached, (max(self._volume - 1, 0) + in_volume) / self._volumes)
        return self._reached

    @property
    def seconds_left(self) -> float | None:
        """A guess; None while there is too little to guess from."""
        elapsed = time.monotonic() - self._started
        if elapsed < _LEAST_SECONDS or self.share < _LEAST_SHARE:
            return None
        return elapsed * (1.0 - self.share) / self.share

    @property
    def what(self) -> str:
        """What is being done, short enough for a narrow sidebar."""
        text = _TITLES.get(self._phase, self._phase.capitalize())
        if self._total:
            text += f" {min(self._done, self._total)}/{self._total}"
        elif self._done:
            text += f" {self._done}"
        return text

    @property
    def which(self) -> str:
        """The volume where there are several, and the time that is left where it can be guessed."""
        left = self.seconds_left
        parts = [self.name] if self._volumes > 1 and self.name else []
        if left is not None:
            parts.append(f"{left:.0f} s left" if left < 90 else f"{left / 60:.0f} min left")
        return ", ".join(parts)

    def __str__(self) -> str:
        return ", ".join(part for part in (self.what, self.which) if part)
