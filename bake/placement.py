# SPDX-License-Identifier: GPL-3.0-or-later
"""Where probes stand and which of them count: direct light tells shells from solids, probes in or behind walls move
out, those that stay inside a solid are invalid."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..core import clearance, relocation
from ..core.clearance import Obstacles
from ..core.grid import Grid
from ..core.kept import Kept
from ..core.orientation import ShellVote
from ..core.steps import Steps
from ..gpu_shaders.backend import GpuBackend
from ..gpu_shaders.probe_views import exits, sightings
from .batches import Batches

_WALLS_OF_A_CORNER = 3
_WAYS = 2  # that a probe tries from its node
_kept_clear = Kept(clearance.keep_clear, last=1 + _WAYS * _WALLS_OF_A_CORNER)


@dataclass
class Placement:
    """S slots of active probes."""

    nodes: np.ndarray  # (S,) grid indices
    home: np.ndarray  # (S, 3) world metres: the node, or where the user put the probe
    by_hand: np.ndarray  # (S,) bool: the user put it there, and there it stays
    step: np.ndarray  # (S, 3) metres from there to where it captures
    shares: np.ndarray  # (S, 4) of the sphere, see GpuBackend.read_shares
    misplaced: np.ndarray  # (S,) bool: worth moving, as seen from home
    went_back: np.ndarray  # (S,) bool: was moved, stood no better there and went home
    light_elsewhere: bool = False  # probes of other blocks see light

    @classmethod
    def at_home(cls, grid: Grid, nodes: np.ndarray, by_hand_m: np.ndarray, obstacles: Obstacles) -> Placement:
        """Clear of ``obstacles``, else nothing is known yet; ``by_hand_m`` (P, 3) are the user's own moves of
        all probes of the grid."""
        count = len(nodes)
        by_hand = by_hand_m[nodes].any(axis=1)
        home = (grid.positions() + by_hand_m)[nodes]
        home[~by_hand] = _kept_clear(grid, nodes[~by_hand], home[~by_hand], obstacles)
        return cls(
            nodes,
            home,
            by_hand,
            np.zeros((count, 3)),
            np.zeros((count, 4)),
            np.zeros(count, bool),
            np.zeros(count, bool),
        )

    @property
    def moved(self) -> np.ndarray:
        """(S,) bool: stands elsewhere than at home."""
        return self.step.any(axis=1)

    @property
    def is_outdated(self) -> bool:
        """Do ``shares`` of other light ask to move probes that stand at home, or home those that moved?"""
        candidates = self.misplaced_now() & ~self.by_hand & (~self.misplaced | self.went_back)
        return bool((candidates & ~self.moved).any() or (self.misplaced_now() & self.moved).any())

    def remember_misplaced(self) -> None:
        """Notes which probes are worth moving, as seen from home."""
        self.misplaced = self.misplaced_now() & ~self.by_hand

    def misplaced_now(self) -> np.ndarray:
        return relocation.misplaced(self.shares, self.light_elsewhere)


def vote(batches: Batches, backend: GpuBackend, for_others: bool = False) -> Steps[ShellVote]:
    """What the probes see of objects' back faces, by the direct light of their patches. ``for_others``: of a block
    among several, which must know whether anything is lit here."""
    result = ShellVote(backend.object_count)
    for index in range(batches.count):
        surfaces = yield from batches.bound(index)
        result.add(sightings(backend, surfaces))
        if for_others:
            backend.statistics(surfaces)
        yield
    if for_others:
        result.sees_light = bool(backend.read_shares()[:, 2].any())
    return result


def judge(placement: Placement, batches: Batches, backend: GpuBackend, verdict: ShellVote) -> Steps[None]:
    """What probes see as a whole. ``verdict``: the votes of all probes together."""
    backend.set_shells(verdict.shells())
    for index in range(batches.count):
        yield from _statistics(batches, index, backend)
    placement.shares = backend.read_shares()
    placement.light_elsewhere = verdict.sees_light


def judge_again(placement: Placement, batches: Batches, backend: GpuBackend) -> Steps[None]:
    """Votes and judges for other light on the same surfaces: where no probe sees a back face nothing is voted on."""
    if (placement.shares[:, 3] > 0).any():
        verdict = yield from vote(batches, backend)
        yield from judge(placement, batches, backend, verdict)
        return
    for index in range(batches.count):
        yield from _statistics(batches, index, backend)
    placement.shares = backend.read_shares()


def place(
    placement: Placement,
    batches: Batches,
    backend: GpuBackend,
    grid: Grid,
    obstacles: Callable[[], Obstacles],
    verdict: ShellVote,
) -> Steps[None]:
    """Fills ``placement`` from texel surfaces captured at home whose patches have direct light.

    ``obstacles()``: what to keep clear of.
    """
    yield from judge(placement, batches, backend, verdict)
    placement.remember_misplaced()
    yield from _relocate(placement, batches, backend, grid, obstacles)


def _statistics(batches: Batches, index: int, backend: GpuBackend) -> Steps[None]:
    surfaces = yield from batches.bound(index)

    def statistics(start: int, number: int) -> None:
        backend.statistics(surfaces, start, number)

    yield from batches.pace.portions("statistics", surfaces.count, statistics)


def _relocate(
    placement: Placement, batches: Batches, backend: GpuBackend, grid: Grid, obstacles: Callable[[], Obstacles]
) -> Steps[None]:
    """Moves probes that stand in or behind walls, through as many as meet in a corner. One that still does at its last
    place goes home and tries another way, as a wall's near side may be that of the void; one that came out into a dark
    room stays, or the wall of that room would be left to probes of the lit one next door. Where they came out, and in
    rooms with normals outwards, they keep clear of surfaces too."""
    step = placement.step
    leaving = placement.misplaced
    beside = ~placement.misplaced & ~placement.by_hand & (placement.shares[:, 3] > 0)  # others were kept clear before
    failed = np.zeros_like(step)
    for _ in range(_WAYS):
        first_step = yield from _leave(placement, leaving, beside, failed, batches, backend, grid, obstacles)
        back = placement.moved & placement.misplaced & placement.misplaced_now()
        if not back.any():
            break
        failed[back] = first_step[back]
        step[back] = 0.0
        yield from _stand(placement, np.flatnonzero(back), batches, backend)
        placement.went_back |= back
        leaving, beside = back, np.zeros_like(beside)
    yield from _step_inwards(placement, batches, backend, grid, obstacles)
    placement.went_back &= ~placement.moved


def _step_inwards(
    placement: Placement, batches: Batches, backend: GpuBackend, grid: Grid, obstacles: Callable[[], Obstacles]
) -> Steps[None]:
    """Moves probes that went back from all their ways out away from the faces of the box, if they stand better
    there."""
    for cells in relocation.INWARD_CELLS:
        lost = np.flatnonzero(placement.went_back & ~placement.moved)
        step = relocation.inward(grid, placement.nodes[lost], cells)
        lost, step = lost[step.any(axis=1)], step[step.any(axis=1)]
        if not len(lost):
            return
        placement.step[lost] = step
        settled = np.zeros_like(placement.went_back)
        settled[lost] = True
        yield from _keep_clear(placement, settled, batches, grid, obstacles)
        yield from _stand(placement, lost, batches, backend)
        still = lost[placement.misplaced_now()[lost]]
        placement.step[still] = 0.0
        yield from _stand(placement, still, batches, backend)


def _leave(
    placement: Placement,
    leaving: np.ndarray,
    beside: np.ndarray,
    failed: np.ndarray,
    batches: Batches,
    backend: GpuBackend,
    grid: Grid,
    obstacles: Callable[[], Obstacles],
) -> Steps[np.ndarray]:
    """Moves probes ``leaving`` (S,) through one wall after the other, not along ``failed`` (S, 3), and those ``beside``
    (S,) surfaces off them; returns the moves (S, 3) through the first wall."""
    step = placement.step
    first_step = step
    for wall in range(_WALLS_OF_A_CORNER):
        before = step.copy()
        yield from _step_out(placement, np.flatnonzero(leaving), failed, batches, backend, grid)
        first_step = first_step if wall else step.copy()
        settled = beside | (step != before).any(axis=1)
        if settled.any():
            yield from _keep_clear(placement, settled, batches, grid, obstacles)
        changed = (step != before).any(axis=1)
        if not changed.any():
            break
        yield from _stand(placement, np.flatnonzero(changed), batches, backend)
        leaving = changed & placement.misplaced & placement.misplaced_now()
        beside = np.zeros_like(beside)
    return first_step


def _step_out(
    placement: Placement,
    leaving: np.ndarray,
    failed: np.ndarray,
    batches: Batches,
    backend: GpuBackend,
    grid: Grid,
) -> Steps[None]:
    """Moves probes ``leaving`` (L,) through the nearest surface, where one is near enough, not along ``failed`` (S,
    3)."""
    for index in range(batches.count):
        slots = batches.slots_of(index, leaving)
        if len(slots):
            surfaces = yield from batches.bound(index)
            found = exits(backend, surfaces, slots - surfaces.first)
            home, step = placement.home[slots], placement.step[slots]
            placement.step[slots] += relocation.moves(grid, home, found, step, failed[slots])
        yield


def _keep_clear(
    placement: Placement, settled: np.ndarray, batches: Batches, grid: Grid, obstacles: Callable[[], Obstacles]
) -> Steps[None]:
    """Moves probes ``settled`` (S,) off surfaces that are too near."""

    def keep_clear() -> np.ndarray:
        at = (placement.home + placement.step)[settled]
        return _kept_clear(grid, placement.nodes[settled], at, obstacles(), True)

    placement.step[settled] = (yield from batches.pace.in_background(keep_clear)) - placement.home[settled]


def _stand(placement: Placement, changed: np.ndarray, batches: Batches, backend: GpuBackend) -> Steps[None]:
    """Captures and judges probes ``changed`` (L,) where they stand now."""
    backend.set_probes(placement.nodes, placement.home + placement.step)
    yield from batches.capture_again(changed)
    yield from batches.stopwatch.steps("light", backend.light.light_new_patches())
    for index in range(batches.count):
        if len(batches.slots_of(index, changed)):
            yield from _statistics(batches, index, backend)
    placement.shares = backend.read_shares()
