# SPDX-License-Identifier: GPL-3.0-or-later
"""Patches: pieces of surface that share one irradiance.

Light bounces between patches, and a texel of a probe shows the light of the patch that it lies on. Hundreds of probes
that look at one wall so share its shadow rays and its bounces.

Space is divided into cubic cells, and what lies in one cell, faces one way and is not cut off by a wall is a patch:

    cell of edge s ┌────────┬────────┐
                   │  ·   · ║ ·      │   · hits of texels and rays      ║ a wall: hits right of it do not see the
      floor  ──────┼──·───·─║──·──·──┼   leader of the patch left of it and found a second one
                   └────────┴────────┘

s is a share of the probes' spacing and grows with the distance from the volume. Seen from a probe close by, a surface
gets cells as small as the view demands (ANGLE), so patches are about equally small in every probe's sight. Rays
between patches end on cells of the plain size.

Everything here is deterministic: the leader of a patch is the first of its hits, and patches are numbered in the order
of their leaders. gpu_shaders/patch_finder.py does the same on the GPU.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .grid import Grid

POINTS = 16  # places of a patch where light is measured
RAYS = 8  # that leave a patch for others, from its points in turn; a multiple of 4
SAMPLES = (1, 4, 16, 64)  # of direct light, by the error that one would leave
MOST_PARTS = 16  # in which direct light of lamps is kept; and shadow rays of a place
EMITTERS, ALL = "emitters", "all"
Part = tuple[int, int] | str  # of the light: a range of the list of lamps and suns, EMITTERS, or ALL
NO_PATCH, NOTHING = -1, -2  # in place of a patch: not bound; nothing to bind
ANGLE = 0.7  # radians: most edge of a patch as a probe sees it
_MANY_PROBES = 128  # in smaller grids probes share less, and patches are smaller in their sight
_LEAST_ANGLE = 0.25  # of ANGLE
_MANY = 44000  # patches whose mean is good with the plain number of rays
_COARSE = 8  # texels along the edge of a face
_MOST_EFFORT = 256
ERRORS = (0.28, 1.1, 4.4)  # of one sample, of the light, from which on the next of SAMPLES is taken
SHADOWED = 0.25  # variance of light that may or may not be shadowed, of its square
DARK = 0.1  # of the mean light: errors of darker patches are held against this
PATIENCE = 32  # bounces: where light needs more to come and go nobody waits for it, nor do path tracers
SLOW = 1 - 1 / PATIENCE  # of the change before: what a bounce changes there
MOST_CAUGHT = 4  # patches whose rays may end on nothing but each other by chance
_CELL_SHARE = 0.25  # of the grid's shortest spacing: edge of plain cells
_LEAST_CELLS = 32  # plain cells along the diagonal of the volume's box
VARIANTS = 4  # patches of one cell that do not see each other; texels beyond show the last
_FINEST = -10  # level: cells of 2⁻¹⁰ of the plain size
_SHIFT = 0.37  # of a cell: walls tend to lie at round numbers
_AXIS_BITS = 18
_SHEET_KEY = np.uint64(0x9E3779B97F4A7C15)  # odd: tells the cells of one sheet from those of another
_SCRAMBLE, _UNSCRAMBLE = np.uint32(0x9E3779B1), np.uint32(0x0E8B2F51)  # inverse to each other modulo 2³²
_NOBODY = np.uint32(0xFFFFFFFF)
MOST_ROUNDS = 8  # of rays that find surface which nothing has seen before
_COARSEST = 3  # levels by which patches grow that only rays see


def effort(count: int, samples: int, face: int) -> int:
    """By how much RAYS and SAMPLES are multiplied for a bake of ``count`` patches with the settings ``samples`` and
    ``face``: what probes see is the mean over patches, so few patches need more of each; half of that where texels are
    so coarse that they err more."""
    few = 2 ** int(np.clip(1.5 * np.log2(_MANY / max(count, 1)) - (face <= _COARSE), 0, 4))
    return min(few * samples, _MOST_EFFORT)


def gather_rays(samples: int) -> int:
    """Rays of one texel in the final gather; a multiple of 4."""
    return 4 * -(-samples // 4)


def direct_samples(mean: np.ndarray, deviation: np.ndarray, light: np.ndarray, mean_light: float) -> np.ndarray:
    """(N,) index into SAMPLES for patches to which a part of the light sends ``mean`` (N,) with ``deviation`` (N,) a
    sample if nothing stands between.

    The error of one sample is held against ``light`` (N,), what all parts send to the patch, so that dark corners do
    not get noisy; but no darker than DARK of ``mean_light``, that of all patches, as nobody would see it, and no
    brighter than that, as probes see bright patches beside others. Samples in proportion to that error give the least
    noise for their number; ERRORS lie halfway between SAMPLES, as ratios.
    """
    error = np.sqrt(deviation**2 + SHADOWED * mean**2)
    return np.searchsorted(ERRORS, error / np.maximum(np.clip(light, DARK * mean_light, mean_light), 1e-30), "right")


def lamps_a_ray(lamps: int) -> int:
    """Neighbours in the list of ``lamps`` that share a shadow ray: none where there are MOST_PARTS or fewer."""
    return max(-(-lamps // MOST_PARTS), 1)


def light_parts(lamps: int, has_emitters: bool) -> list[Part]:
    """What sends direct light that is kept apart: each of ``lamps``, or those that share a ray, and all sampled
    emitters."""
    size = lamps_a_ray(lamps)
    parts: list[Part] = [(first, min(first + size, lamps)) for first in range(0, lamps, size)]
    return [*parts, EMITTERS] if has_emitters else parts


def spread_points(part: Part, lamps: int) -> int:
    """At how many points of a patch it is looked how unevenly ``part`` of the light of ``lamps`` falls: at half of
    them, or at fewer where many lamps would have to be asked at each."""
    return max(POINTS // 2 // (1 if part == EMITTERS else lamps_a_ray(lamps)), 2)


def coarser_by(round_: int) -> int:
    """Levels by which cells grow for what only rays of a round see."""
    return min(round_, _COARSEST)


def caught(ends: np.ndarray) -> np.ndarray:
    """(N,) bool: patches whose rays (N, R) keep light among MOST_CAUGHT patches at most for ever.

    In a slit all rays of a patch end on the one across, and all of that one's back on it: none of so few found the way
    out. Between white walls light would add up there without end, so the first ray of each counts as lost. Of the other
    patches it is the rays but the first that are looked at, which stay.
    """
    result = np.zeros(len(ends), bool)
    ends_of = ends.tolist()
    for patch, rest in enumerate(ends_of):
        members = [patch]
        while rest and NOTHING not in rest:
            found = [end for end in dict.fromkeys(rest) if end != NO_PATCH and end not in members]
            members += found
            if len(members) > MOST_CAUGHT:
                break
            rest = [end for member in found for end in ends_of[member][1:]]
        result[patch] = not rest
    return result


def without_caught(ends: np.ndarray) -> np.ndarray:
    """Ends of rays (N, R) with the first ray of patches that are caught lost."""
    return np.where(caught(ends)[:, None] & (np.arange(ends.shape[1]) == 0), NOTHING, ends)


def tail_squared(change: np.ndarray, last_change: np.ndarray) -> np.ndarray:
    """(N,) |what is still to come|² of patches by their last changes (N, 3), if it comes within PATIENCE bounces."""
    square, before = (change**2).sum(axis=1), (last_change**2).sum(axis=1)
    ratio = np.minimum(np.sqrt(square / np.maximum(before, 1e-37)), SLOW)
    return square * (ratio / (1 - ratio)) ** 2


def is_slow(irradiance: np.ndarray, change: np.ndarray, last_change: np.ndarray, tolerance: float) -> np.ndarray:
    """(N,) bool: patches in hollows, whose last changes (N, 3) are nearly the same and would add up to more than the
    ``tolerance`` of their ``irradiance`` (N, 3) in as many bounces as light takes there."""
    square, before = (change**2).sum(axis=1), (last_change**2).sum(axis=1)
    return (square > SLOW**2 * before) & (square > (tolerance * (1 - SLOW)) ** 2 * (irradiance**2).sum(axis=1))


class CellRule:
    """Which cell a hit lies in. Positions are metres relative to the grid's origin."""

    def __init__(self, grid: Grid):
        spacing = grid.cell_size()
        self.cell = min(
            _CELL_SHARE * float(np.exp(np.log(spacing).mean())),
            float(np.linalg.norm(grid.matrix[:3, :3] * 2)) / _LEAST_CELLS,
        )
        self._angle = ANGLE * float(np.clip(np.sqrt(grid.count / _MANY_PROBES), _LEAST_ANGLE, 1.0))
        self._to_box = np.linalg.inv(grid.matrix[:3, :3]).astype(np.float32)
        self._half = np.linalg.norm(grid.matrix[:3, :3], axis=0).astype(np.float32)
        self._middle = (grid.center - grid.origin).astype(np.float32)  # of the box, in the frame of hits

    def rows(self) -> np.ndarray:
        """(5, 4) float32 as patch_keys_comp.glsl reads it."""
        rows = np.zeros((5, 4), np.float32)
        rows[:3, :3], rows[:3, 3] = self._to_box, self._half
        rows[3] = self.cell, 2.0**_FINEST, _SHIFT, self._angle
        rows[4, :3] = self._middle
        return rows

    def keys(self, hits: np.ndarray, view_distance: np.ndarray | None, coarser: int) -> np.ndarray:
        """(H,) uint64: size, place and facing of the cell that each of ``hits`` lies in."""
        # Columns in float32: bakes bind millions of hits, and only borders of cells move by rounding.
        position = np.ascontiguousarray(hits[:, :3].T)
        beyond = np.maximum(np.abs(self._to_box @ (position - self._middle[:, None])) - 1, 0) * self._half[:, None]
        wanted = np.maximum(np.float32(0.5 * self._angle / self.cell) * np.sqrt((beyond * beyond).sum(axis=0)), 1)
        if view_distance is not None:
            wanted = np.minimum(wanted, np.float32(self._angle / self.cell) * view_distance.astype(np.float32))
            wanted = np.maximum(wanted, np.float32(2.0**_FINEST))
        level = np.frexp(wanted)[1] - 1 + coarser  # ⌊log2⌋
        place = np.floor(position * np.ldexp(np.float32(1 / self.cell), -level) + np.float32(_SHIFT))
        key = ((level + 16) * 27 + _facing(hits[:, 3])).astype(np.uint64)
        for axis in range(3):
            inside = place[axis].astype(np.int32) & ((1 << _AXIS_BITS) - 1)
            key = (key << np.uint64(_AXIS_BITS)) | inside.astype(np.uint64)
        return key


class Patches:
    """All patches of a bake.

    ``points`` (N, POINTS, 4) float32: position and packed normal; the first is the leader, which every hit of the
    patch sees. ``seen`` (N,) bool: a texel of a probe lies on it. ``sheets`` (N,) int: the sheet that it is part of
    (core/sheets.py), 0 for none.
    """

    def __init__(self, grid: Grid):
        self._rule = CellRule(grid)
        self.cell = self._rule.cell
        self._keys = [np.zeros(0, np.uint64) for _ in range(VARIANTS)]  # sorted
        self._ids = [np.zeros(0, np.int64) for _ in range(VARIANTS)]
        self.points = np.zeros((0, POINTS, 4), np.float32)
        self.seen = np.zeros(0, bool)
        self.sheets = np.zeros(0, np.int64)

    @property
    def count(self) -> int:
        return len(self.points)

    def bind(
        self,
        hits: np.ndarray,
        view_distance: np.ndarray | None,
        sees: Callable[[np.ndarray, np.ndarray], np.ndarray],
        found: bool = True,
        coarser: int = 0,
        row_length: int = 4,
        sheets: np.ndarray | None = None,
    ) -> np.ndarray:
        """(H,) patch of each of ``hits`` (H, 4), position and packed normal; NO_PATCH for hits with a negative one.
        Patches that are missing are founded, or left NO_PATCH without ``found``.

        Of a hit that sees none of the VARIANTS leaders in its cell, a texel shows the light of the last, as it has to
        show some, and a ray has NO_PATCH: joining it there lit closed cupboards, where a crowded corner's cell held
        the inside and the outside.

        ``view_distance`` (H,) metres to the probe whose texels the hits are; None for ends of rays between patches.
        ``sees(items, patches)`` tells which hits (by number) see the leader of a patch. ``row_length``: hits in a row,
        whose neighbours lie side by side. ``sheets`` (H,) int: the sheet that each hit lies on; None for no sheets.
        """
        sheets = np.zeros(len(hits), np.int64) if sheets is None else sheets
        result = np.full(len(hits), NO_PATCH, np.int64)
        pending = np.flatnonzero(hits[:, 3] >= 0)
        keys = self._rule.keys(hits[pending], None if view_distance is None else view_distance[pending], coarser)
        keys = keys + sheets[pending].astype(np.uint64) * _SHEET_KEY
        first_new = self.count
        competes = np.ones(len(hits), bool)
        for variant in range(VARIANTS):
            if not len(pending):
                break
            unique, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
            known = self._known(variant, unique)
            if found:
                self._found(variant, unique, known, pending[first], hits, sheets)
            ids = known[inverse]
            joined = (ids >= first_new) & (first[inverse] == np.arange(len(pending)))  # a leader sees itself
            competes[pending[joined]] = False
            ask = np.flatnonzero((ids >= 0) & ~joined)
            if len(ask):
                joined[ask] = sees(pending[ask], ids[ask])
            if variant == VARIANTS - 1 and view_distance is not None:
                blind = ~joined & (ids >= 0)
                result[pending[blind]] = ids[blind]
                competes[pending[blind]] = False
            result[pending[joined]] = ids[joined]
            pending, keys = pending[~joined], keys[~joined]
        if view_distance is not None:
            self.seen[result[result >= 0]] = True
        if found:
            self._choose_points(first_new, hits, np.where(competes, result, NO_PATCH), row_length)
        return result

    def bind_ends(
        self,
        hits: np.ndarray,
        round_: int,
        sees: Callable[[np.ndarray, np.ndarray], np.ndarray],
        sheets: np.ndarray | None = None,
    ) -> np.ndarray:
        """(H,) patches on which rays of a round end, NOTHING for ``hits`` (H, 4) without surface, where no light comes
        back. What only rays see gets the coarser patches the more rays it takes to see it, in the last round none."""
        ends = self.bind(hits, None, sees, found=round_ == 0, sheets=sheets)
        lost = (ends == NO_PATCH) & (hits[:, 3] >= 0)
        ends[hits[:, 3] < 0] = NOTHING
        if lost.any() and 0 < round_ < MOST_ROUNDS - 1:
            alone = hits.copy()
            alone[~lost, 3] = -1.0
            ends[lost] = self.bind(alone, None, sees, coarser=coarser_by(round_), sheets=sheets)[lost]
        return ends

    def _known(self, variant: int, unique: np.ndarray) -> np.ndarray:
        """(U,) patches with the sorted keys ``unique`` (U,), NO_PATCH where there is none."""
        keys, ids = self._keys[variant], self._ids[variant]
        at = np.searchsorted(keys, unique)
        result = np.full(len(unique), NO_PATCH, np.int64)
        inside = np.flatnonzero(at < len(keys))
        same = inside[keys[at[inside]] == unique[inside]]
        result[same] = ids[at[same]]
        return result

    def _found(
        self,
        variant: int,
        unique: np.ndarray,
        known: np.ndarray,
        leaders: np.ndarray,
        hits: np.ndarray,
        sheets: np.ndarray,
    ) -> None:
        """Founds patches for those of the sorted keys ``unique`` (U,) that are not in ``known`` (U,), led by the hits
        ``leaders`` (U,), numbered in their order, and completes ``known``."""
        fresh = np.flatnonzero(known == NO_PATCH)
        in_order = fresh[np.argsort(leaders[fresh])]
        known[in_order] = self.count + np.arange(len(fresh))
        at = np.searchsorted(self._keys[variant], unique[fresh])
        self._keys[variant] = np.insert(self._keys[variant], at, unique[fresh])
        self._ids[variant] = np.insert(self._ids[variant], at, known[fresh])
        points = np.repeat(hits[leaders[in_order], None], POINTS, axis=1).astype(np.float32)
        self.points = np.concatenate([self.points, points])
        self.seen = np.concatenate([self.seen, np.zeros(len(fresh), bool)])
        self.sheets = np.concatenate([self.sheets, sheets[leaders[in_order]]])

    def _choose_points(self, first_new: int, hits: np.ndarray, patch: np.ndarray, row_length: int) -> None:
        """Points of the patches from ``first_new`` on beside their leaders: a hit competes for one of POINTS places, by
        where it lies in blocks of 4×4 neighbours, the lowest scrambled number wins, and winners share the points
        evenly."""
        member = np.flatnonzero(patch >= first_new)
        place = (member % row_length & 3) + 4 * (member // row_length & 3)
        scrambled = member.astype(np.uint32) * _SCRAMBLE
        winner = np.full((self.count - first_new, POINTS), _NOBODY)
        np.minimum.at(winner, (patch[member] - first_new, place), scrambled)
        won = winner < _NOBODY
        won[:, 0] = True  # the leader's
        position = np.argsort(~won, axis=1, kind="stable")  # places that somebody has, in order
        chosen = np.arange(POINTS) * won.sum(axis=1)[:, None] // POINTS
        place = np.take_along_axis(position, chosen, axis=1)
        rows, columns = np.nonzero(place > 0)
        hit = winner[rows, place[rows, columns]] * _UNSCRAMBLE
        self.points[first_new + rows, columns] = hits[hit]


def _facing(packed: np.ndarray) -> np.ndarray:
    """(H,) number 0..26 of the one among 26 directions (axes, edges and corners of a cube) that is nearest to packed
    normals (H,)."""
    high = np.floor(packed / np.float32(4096))
    u = (packed - np.float32(4096) * high - 2048) / np.float32(2047)
    v = (high - 2048) / np.float32(2047)
    z = 1 - np.abs(u) - np.abs(v)
    fold = np.maximum(-z, 0)
    x, y = u - np.copysign(fold, u), v - np.copysign(fold, v)
    most = np.maximum(np.maximum(np.abs(x), np.abs(y)), np.abs(z))
    return (9 * np.rint(x / most) + 3 * np.rint(y / most) + np.rint(z / most)).astype(np.int32) + 13
