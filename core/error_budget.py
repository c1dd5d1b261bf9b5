# SPDX-License-Identifier: GPL-3.0-or-later
"""A target for the error at probes, and which settings are the cheapest that should meet it.

The squared error of a bake within its bands is taken for the sum of three parts:

    e² = a / face³  +  b / samples  +  c

texels that are too coarse, noise of rays and shadow rays, and what neither takes away (patches that are too large).
An edge of light crosses as many texels as a face has along it, and each is off by a part of its own size, f⁻², by
chance: the sum varies by f · f⁻⁴. Every bake that was checked is one equation for a, b and c. Until there are three, a
guess fills the gap: with faces of 16² and one sample, texels and noise do equally much harm, as they do in some scenes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from .errors import InputError

LEAST_TARGET, MOST_TARGET = 1e-3, 1.0
_FIRST_FACES = (0.08, 6), (0.06, 8), (0.035, 12), (0.015, 16), (0.0, 24)  # from which target on
_FACES = (6, 8, 12, 16, 24, 32, 48, 64)
_SAMPLES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)
_GUESS_WEIGHT = 0.3  # of the guess beside what was measured
_GUESSED_RATIO = 16.0**3  # a / b
# Seconds of a bake, in those of what does not depend on any setting (docs/measurements.md, "Error-driven bakes").
_COST_OF_TEXELS = 5e-5  # per probe and squared texels of a face's edge
_COST_OF_SAMPLES = 2.5
_COST_OF_PATHS = 1.0 / 30000
_MOST_OUTLYING = 4.0
_LEAST_SHARE = 0.25


@dataclass(frozen=True)
class ErrorGoal:
    """``target``: relative RMS of irradiance at probes. ``kept``: names of settings that the user chose.

    Raises:
        InputError: the target is out of range.
    """

    target: float
    kept: frozenset[str] = frozenset()

    def __post_init__(self):
        if not LEAST_TARGET <= self.target <= MOST_TARGET:  # also false for NaN
            raise InputError(f"--error is {self.target}; it must lie between {LEAST_TARGET} and {MOST_TARGET:g}")


@dataclass(frozen=True)
class Level:
    """Settings that trade time for error. ``samples`` counts those of all passes that are put together."""

    face: int
    samples: int

    def cost(self, probes: int) -> float:
        """Of one bake, in arbitrary units."""
        return 1.0 + _COST_OF_TEXELS * probes * self.face**2 + _COST_OF_SAMPLES * self.samples

    def beyond(self, before: Level) -> Level:
        """What to bake where ``before`` is there: samples of passes with the same face add up, another begins anew."""
        return Level(self.face, self.samples - before.samples if self.face == before.face else self.samples)


def cost_of_paths(count: int) -> float:
    """Of following ``count`` paths, in the same units."""
    return _COST_OF_PATHS * count


def first_level(goal: ErrorGoal, face: int, samples: int) -> Level:
    """What to begin with, which most scenes need no more than, or what the user keeps of ``face`` and ``samples``. A
    bake far below its target costs less than the paths that find another to be a little below."""
    small = next((face for least, face in _FIRST_FACES if goal.target >= least), _FIRST_FACES[-1][1])
    return Level(face if "face" in goal.kept else small, samples if "samples" in goal.kept else 1)


@dataclass
class ErrorModel:
    """Levels that were checked with their squared errors within the bands."""

    levels: list[Level] = field(default_factory=list)
    squared: list[float] = field(default_factory=list)

    def set(self, level: Level, squared: float) -> None:
        """Notes what ``level`` was found to err; of one that is known already, what is known now."""
        if not self.levels or self.levels[-1] != level:
            self.levels.append(level)
            self.squared.append(0.0)
        self.squared[-1] = max(squared, 1e-12)

    def parts(self, level: Level) -> tuple[float, float, float]:
        """Squared errors at ``level`` by texels, by noise, and the rest."""
        texels, noise, rest = self._fitted() * _terms(level)
        return float(texels), float(noise), float(rest)

    def predicted(self, level: Level) -> float:
        """Squared error at ``level``."""
        return sum(self.parts(level))

    def _fitted(self) -> np.ndarray:
        """(3,) a, b and c ≥ 0 that fit best, relative to each measured error."""
        guess, size = self.levels[0], self.squared[0]
        rows = [_terms(level) / squared for level, squared in zip(self.levels, self.squared)]
        sides = [1.0] * len(rows)
        if len(self.levels) < 3:
            texels, noise, _rest = _terms(guess) * [_GUESSED_RATIO, 1.0, 0.0]
            for part, share in enumerate((texels, noise)):
                rows.append(_GUESS_WEIGHT * np.eye(3)[part] * _terms(guess) / size)
                sides.append(_GUESS_WEIGHT * share / (texels + noise))
            rows.append(_GUESS_WEIGHT * np.eye(3)[2] / size)
            sides.append(0.0)
        return _non_negative(np.array(rows), np.array(sides))


def _terms(level: Level) -> np.ndarray:
    return np.array([1.0 / level.face**3, 1.0 / level.samples, 1.0])


def _non_negative(rows: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """The best x ≥ 0 of rows · x = sides by least squares: of all choices of unknowns that are not zero, the best."""
    best, least = np.zeros(rows.shape[1]), np.inf
    scale = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    for count in range(1, rows.shape[1] + 1):
        for chosen in map(list, combinations(range(rows.shape[1]), count)):
            found = np.linalg.lstsq(rows[:, chosen] / scale[chosen], sides, rcond=None)[0] / scale[chosen]
            if (found < 0).any():
                continue
            rest = float(((rows[:, chosen] @ found - sides) ** 2).sum())
            if rest < least - 1e-12:
                best, least = np.zeros(rows.shape[1]), rest
                best[chosen] = found
    return best


def next_level(
    model: ErrorModel, now: Level, wanted: float, kept: frozenset[str], probes: int, most_cost: float
) -> Level | None:
    """The cheapest level above ``now`` that should bring the squared error down to ``wanted``, or the one that comes
    nearest to it within ``most_cost``; None where nothing does or helps by a tenth.

    Samples of passes with the same face add up, so that only what is missing is paid for; another face begins anew.
    """
    found: list[tuple[bool, float, float, Level]] = []
    for face in sorted({*_FACES, now.face}):
        for samples in sorted({*_SAMPLES, now.samples}):
            if face < now.face or (face != now.face and "face" in kept):
                continue
            if (samples != now.samples and "samples" in kept) or (face == now.face and samples <= now.samples):
                continue
            level = Level(face, samples)
            cost, squared = level.beyond(now).cost(probes), model.predicted(level)
            if cost <= most_cost:
                enough = squared <= wanted
                found.append((not enough, cost if enough else squared, cost, level))
    if not found:
        return None
    falls_short, *_, best = min(found, key=lambda entry: entry[:3])
    return best if not falls_short or model.predicted(best) < 0.9 * model.predicted(now) else None


def worst_probes(squared: np.ndarray, gain: float, wanted: float) -> np.ndarray:
    """(P,) bool: the fewest probes, those with the largest of the ``squared`` (P,) errors, whose errors times ``gain``
    bring the mean of all down to ``wanted``; all where that takes more than half of them.

    Errors are known by one difference of two bakes: a few that are huge by chance must not hide the others, so each
    counts as _MOST_OUTLYING times the mean at most, and fewer than _LEAST_SHARE are not worth a pass of their own.
    """
    squared = np.minimum(squared, _MOST_OUTLYING * squared.mean())
    order = np.argsort(-squared, kind="stable")
    saved = (1.0 - gain) * np.cumsum(squared[order])
    enough = np.flatnonzero((squared.sum() - saved) / max(len(squared), 1) <= wanted)
    count = max(int(enough[0]) + 1, int(_LEAST_SHARE * len(squared))) if len(enough) else len(squared)
    chosen = np.zeros(len(squared), bool)
    chosen[order[: count if count <= len(squared) // 2 else len(squared)]] = True
    return chosen
