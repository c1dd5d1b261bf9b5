# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds patches on the GPU; what a patch is: core/patches.py, whose class Patches is the readable twin.

A bind gives each of its hits a patch, variant by variant of their cells:

    keys ──► claim ──► count, number ──► join ──► (those that do not see their leader) ──► claim …
             cells      new patches       hits that see
             in a       in order of       the leader
             table      their leaders

Nothing leaves the GPU but how many patches and hits there are.
"""

from __future__ import annotations

import gpu
import numpy as np

from ..core.errors import InputError
from ..core.grid import Grid
from ..core.patches import MOST_ROUNDS, NO_PATCH, NOTHING, POINTS, VARIANTS, CellRule, coarser_by
from .dispatch import compaction_groups, compaction_run, dispatch_linear
from .elements import fill_elements
from .growing_array import GrowingArray
from .places import Places, find_couplings
from .programs import program
from .scene_textures import SceneTextures
from .textures import allocate_integers, numbers, read, read_number, scratch, upload

_FREE, _NOBODY = 0, 0xFFFFFFFF
_FEW = 1 << 14  # hits: below, room for as many patches is made unasked, and hits are not listed
_MOST_PLACES = 1 << 24  # of the table: their numbers are kept as float32


class PatchFinder:
    """All patches of a bake: ``points`` (N·POINTS elements: position relative to the grid's centre and packed normal,
    the leader first) and ``seen`` (1 where a texel of a probe lies on a patch) as linear textures."""

    def __init__(self, scene: SceneTextures, grid: Grid):
        rule = CellRule(grid)
        self._scene = scene
        self._rule = upload(rule.rows(), "cells")
        self.cell = rule.cell
        self.count = self._most = 0  # patches; and no fewer than there are while hits are bound
        self._keys = GrowingArray("patches")
        self._points = GrowingArray("patches")
        self._seen = GrowingArray("patches", "R32F", fill=0)
        self._sheets = GrowingArray("patches", "R32F", fill=0)
        self._couplings, self._coupled = GrowingArray("patches"), 0  # known of so many patches
        self._candidates = GrowingArray("patches", "R32UI", fill=_NOBODY)
        self._places = 0
        self._totals = [gpu.types.GPUTexture((1, 1), format="R32F") for _ in range(2)]
        fill_elements(self._totals[0], 0, 1, 0.0)
        self._reserve(0)
        self._reserve_table(0)

    @property
    def points(self) -> gpu.types.GPUTexture:
        return self._points.texture

    @property
    def places(self) -> Places:
        """The points with what lighting them asks for."""
        sheets = self._sheets.texture if self._scene.has_sheets else None
        return Places(self.points, POINTS, sheets, self._known_couplings() if self._scene.has_faint_gloss else None)

    def _known_couplings(self) -> gpu.types.GPUTexture:
        """Couplings of all patches, those found now that are not known yet."""
        target = self._couplings.reserve(2 * self.count)
        if self._coupled < self.count:
            find_couplings(self._scene, self.points, POINTS, self._coupled, self.count - self._coupled, target)
            self._coupled = self.count
        return target

    def forget_couplings(self) -> None:
        """Materials are others than before."""
        self._coupled = 0

    @property
    def seen(self) -> gpu.types.GPUTexture:
        return self._seen.texture

    def forget_seen(self) -> None:
        """No probe sees any patch, until ``mark_seen`` tells which do."""
        fill_elements(self.seen, 0, self.count, 0.0)

    def mark_seen(self, textures: dict, face: int, layers: np.ndarray, gloss: dict) -> None:
        """The patches that texels lie on, or mirror, of the probes in ``layers`` (L,) of the texel surfaces
        ``textures``; ``gloss``: defines of those who read what texels mirror."""
        shader, listed = program("patch_seen_comp", FACE=face, **gloss), numbers(layers, "probes")
        if gloss:
            shader.uniform_sampler("mirrored", textures["mirrored"])
        shader.uniform_sampler("probe_layers", listed)
        shader.uniform_sampler("albedo", textures["albedo"])
        shader.image("seen", self.seen)
        gpu.compute.dispatch(shader, len(layers), 1, 1)

    def read_points(self) -> np.ndarray:
        """(N, POINTS, 4) float32."""
        return read(self.points, self.count * POINTS).reshape(-1, POINTS, 4)

    def read_seen(self) -> np.ndarray:
        """(N,) bool"""
        return read(self.seen, self.count, channels=1)[:, 0] > 0

    # Binding
    # ------------------------------------------------------------------------------------------------------------------

    def bind_texels(self, texels: Places, face: int, probe_slots, first_slot: int, probes: int) -> gpu.types.GPUTexture:
        """Patches of the ``texels`` of ``probes`` probes, which stand in slots from ``first_slot`` on: one number an
        element, NO_PATCH where a texel sees nothing to light."""
        count = 6 * face**2
        bind = _Bind(texels, probes * count, face, {"HAS_VIEW": True, "TEXELS": count})
        shader = self._keys_shader(bind, NO_PATCH)
        shader.uniform_sampler("probe_slots", probe_slots)
        shader.uniform_int("first_slot", (first_slot,))
        dispatch_linear(shader, bind.count)
        self._join_or_found(bind)
        return bind.bound

    def bind_ends(self, hits: Places, count: int, round_: int) -> gpu.types.GPUTexture:
        """Patches on which ``count`` rays of a round end at ``hits``, NOTHING where no light comes back. What only
        rays see gets the coarser patches the more rays it takes to see it, in the last round none."""
        bind = _Bind(hits, count, 4, {})
        dispatch_linear(self._keys_shader(bind, NOTHING), count)
        if round_ == 0:
            self._join_or_found(bind)
            return bind.bound
        self._look(bind)
        if round_ < MOST_ROUNDS - 1:
            dispatch_linear(self._keys_shader(bind, NOTHING, coarser_by(round_), only_lost=True), count)
            self._join_or_found(bind)
        return bind.bound

    def _keys_shader(self, bind: _Bind, without_surface: int, coarser: int = 0, only_lost: bool = False):
        shader = program("patch_keys_comp", **bind.view, HAS_SHEETS=bind.sheets is not None)
        shader.uniform_sampler("hits", bind.hits)
        if bind.sheets is not None:
            shader.uniform_sampler("hit_sheets", bind.sheets)
        shader.uniform_sampler("cell_rule", self._rule)
        shader.image("hit_keys", bind.keys)
        shader.image("bound", bind.bound)
        shader.uniform_float("without_surface", without_surface)
        for name, value in (("hit_count", bind.count), ("coarser", coarser), ("only_lost", int(only_lost))):
            shader.uniform_int(name, (value,))
        return shader

    def _look(self, bind: _Bind) -> None:
        """Gives the pending hits of ``bind`` the patches that are there, where they see one."""
        shader = program("patch_look_comp", **self._scene.ray_defines)
        self._scene.bind_rays(shader)
        for name, texture in (
            ("hits", bind.hits),
            ("hit_keys", bind.keys),
            ("patch_keys", self._keys.texture),
            ("patch_points", self.points),
            ("table", self._table),
        ):
            shader.uniform_sampler(name, texture)
        shader.image("bound", bind.bound)
        shader.uniform_int("hit_count", (bind.count,))
        shader.uniform_int("table_mask", (self._places - 1,))
        dispatch_linear(shader, bind.count)

    def _join_or_found(self, bind: _Bind) -> None:
        """Gives the pending hits of ``bind`` their patches, new ones where there are none."""
        first_new = self.count
        self._reserve_table(self.count + bind.count)
        items, item_count = bind.bound, -1  # all hits; the texture stands in for a list that is not read
        for variant in range(VARIANTS):
            before = self._totals[0]
            self._claim(bind, items, item_count, variant)
            self._number(bind, items, item_count, variant)
            last = variant == VARIANTS - 1
            self._join(bind, items, item_count, first_new, before, last)
            if last or bind.count <= _FEW:
                continue
            items, item_count = self._pending(bind, items, item_count)
            if item_count == 0:
                break
        self.count = self._most = read_number(self._totals[0])
        self._choose_points(bind, first_new)

    def _claim(self, bind: _Bind, items, item_count: int, variant: int) -> None:
        shader = program("patch_claim_comp")
        for name, texture in (
            ("items", items),
            ("bound", bind.bound),
            ("hit_keys", bind.keys),
            ("patch_keys", self._keys.texture),
        ):
            shader.uniform_sampler(name, texture)
        for name, texture in (("table", self._table), ("leaders", self._leaders), ("slots", bind.slots)):
            shader.image(name, texture)
        for name, value in (
            ("item_count", item_count),
            ("hit_count", bind.count),
            ("variant", variant),
            ("table_mask", self._places - 1),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, bind.entries(item_count))

    def _number(self, bind: _Bind, items, item_count: int, variant: int) -> None:
        """Makes patches of the cells that were claimed."""
        counts = self._count_by_block(bind, items, item_count, leaders=True)
        entries = bind.entries(item_count)
        if entries <= _FEW:
            self._most += entries  # a hit leads one patch at most
        else:
            per_block = read(counts, compaction_groups(entries), channels=1)
            self._most = read_number(self._totals[0]) + int(per_block.sum())
        self._reserve(self._most)
        sheets = bind.sheets is not None
        shader = self._compaction("patch_number_comp", bind, items, item_count, leaders=True, HAS_SHEETS=sheets)
        if sheets:
            shader.image("patch_sheets", self._sheets.texture)
        for name, texture in (
            ("block_counts", counts),
            ("total_in", self._totals[0]),
            ("hit_keys", bind.keys),
            ("hits", bind.hits),
        ):
            shader.uniform_sampler(name, texture)
        for name, texture in (
            ("total_out", self._totals[1]),
            ("patch_keys", self._keys.texture),
            ("patch_points", self._points.texture),
        ):
            shader.image(name, texture)
        shader.uniform_int("variant", (variant,))
        gpu.compute.dispatch(shader, compaction_groups(entries), 1, 1)
        self._totals.reverse()

    def _join(self, bind: _Bind, items, item_count: int, first_new: int, before, last: bool) -> None:
        shader = program("patch_join_comp", **bind.view, **self._scene.ray_defines)
        self._scene.bind_rays(shader)
        for name, texture in (
            ("items", items),
            ("slots", bind.slots),
            ("hits", bind.hits),
            ("patch_points", self.points),
            ("total_before", before),
            ("table", self._table),
            ("leaders", self._leaders),
        ):
            shader.uniform_sampler(name, texture)
        shader.image("bound", bind.bound)
        shader.image("candidates", self._candidates.texture)
        if "HAS_VIEW" in bind.view:
            shader.image("seen", self.seen)
        for name, value in (
            ("item_count", item_count),
            ("hit_count", bind.count),
            ("first_new", first_new),
            ("row_length", bind.row_length),
            ("is_last", int(last)),
        ):
            shader.uniform_int(name, (value,))
        dispatch_linear(shader, bind.entries(item_count))

    def _pending(self, bind: _Bind, items, item_count: int) -> tuple[gpu.types.GPUTexture, int]:
        """The hits that are still without a patch, in order."""
        counts = self._count_by_block(bind, items, item_count)
        entries = bind.entries(item_count)
        listed = scratch(entries, "hits", "R32F")
        total = gpu.types.GPUTexture((1, 1), format="R32F")
        shader = self._compaction("compact_list_comp", bind, items, item_count)
        shader.uniform_sampler("block_counts", counts)
        shader.image("total_out", total)
        shader.image("listed", listed)
        gpu.compute.dispatch(shader, compaction_groups(entries), 1, 1)
        return listed, read_number(total)

    def _count_by_block(self, bind: _Bind, items, item_count: int, leaders: bool = False) -> gpu.types.GPUTexture:
        """Of entries to be picked; something that nobody reads where there is but one block."""
        blocks = compaction_groups(bind.entries(item_count))
        if blocks == 1:
            return bind.bound
        shader = self._compaction("compact_count_comp", bind, items, item_count, leaders)
        counts = scratch(blocks, "hits", "R32F")
        shader.image("block_counts", counts)
        gpu.compute.dispatch(shader, blocks, 1, 1)
        return counts

    def _compaction(self, name: str, bind: _Bind, items, item_count: int, leaders: bool = False, **defines):
        shader = program(name, LEADERS=leaders, RUN=compaction_run(), **defines)
        shader.uniform_sampler("items", items)
        shader.uniform_sampler("bound", bind.bound)
        if leaders:
            shader.uniform_sampler("slots", bind.slots)
            shader.image("table", self._table)
            shader.image("leaders", self._leaders)
        shader.uniform_int("item_count", (item_count,))
        shader.uniform_int("hit_count", (bind.count,))
        return shader

    def _choose_points(self, bind: _Bind, first_new: int) -> None:
        shader = program("patch_points_comp")
        shader.uniform_sampler("hits", bind.hits)
        shader.uniform_sampler("candidates", self._candidates.texture)
        shader.image("patch_points", self.points)
        shader.uniform_int("first_new", (first_new,))
        shader.uniform_int("patch_count", (self.count,))
        dispatch_linear(shader, self.count - first_new)

    # Room
    # ------------------------------------------------------------------------------------------------------------------

    def _reserve(self, patches: int) -> None:
        self._keys.reserve(patches)
        self._seen.reserve(patches)
        if self._scene.has_sheets:
            self._sheets.reserve(patches)
        self._points.reserve(patches * POINTS)
        self._candidates.reserve(patches * POINTS)

    def _reserve_table(self, patches: int) -> None:
        """A table that is at most half full with so many patches."""
        places = 1 << max(2 * patches, 1 << 16).bit_length()
        if places <= self._places:
            return
        if places > _MOST_PLACES:
            raise InputError("the probes see more surface than the GPU can number; bake a smaller part of the scene")
        self._places = places
        self._table = allocate_integers(places, "patches", _FREE)
        self._leaders = allocate_integers(places, "patches", _NOBODY)
        shader = program("patch_table_comp")
        shader.uniform_sampler("patch_keys", self._keys.texture)
        shader.image("table", self._table)
        shader.uniform_int("patch_count", (self.count,))
        shader.uniform_int("table_mask", (places - 1,))
        dispatch_linear(shader, self.count)


class _Bind:
    """Hits that ask for patches, and what is noted of each."""

    def __init__(self, hits: Places, count: int, row_length: int, view: dict):
        """``row_length``: hits in a row, whose neighbours lie side by side; ``view``: defines of texels."""
        self.hits, self.sheets = hits.points, hits.sheets
        self.count, self.row_length, self.view = count, row_length, view
        self.keys = scratch(count, "hits")
        self.slots = scratch(count, "hits", "R32F")
        self.bound = scratch(count, "hits", "R32F")

    def entries(self, item_count: int) -> int:
        return self.count if item_count < 0 else item_count
