# SPDX-License-Identifier: GPL-3.0-or-later
"""One volume's bake that stays on the GPU, and relights that run only what a change of the scene needs.

    what changed                    what runs again
    lights                          direct light of patches, bounces, projection
    world, emission, reflectance    the same, and materials of texels and of ends of rays; no probe captures
    shape                           the hierarchy where it changed, capture of probes that can see it; then everything
                                    after capture

A relight ends where a fresh bake of the changed scene would end, except that probes which were moved out of walls stay
where they are when only light changes. Steps are generators that yield between pieces of GPU work.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.change_reach import RASTER_SPREAD, grown
from ..core.conventions import CULLED
from ..core.scene_changes import SceneChanges, ShapeChange, compare
from ..core.snapshot import SceneSnapshot
from ..core.steps import Steps
from ..gpu_shaders.change_pass import new_numbers, probes_reached, resolve_again
from .placement import judge_again
from .result import BakeResult, Relit, check_scene
from .volume_bake import VolumeBake


class BakeSession(VolumeBake):
    """``bake`` once, then ``relight`` as often as the scene changes; ``result`` is that of the last one."""

    def relight(self, snapshot: SceneSnapshot, live: bool = False) -> Steps[None]:
        """Brings the bake to ``snapshot``, another state of the scene, in steps; ``result`` is a new one, with
        ``relit``. If the steps are not followed to their end the session must not be used any more.

        ``live``: light is left with the patches. What is ``unshown`` is then up to ``show``, in any order, and there is
        no field before ``finish``; another relight may come in between. Probes stay where they are while only light
        changes, even where a fresh bake would move some or find them in a solid.

        Raises:
            InputError: as ``bake`` does.
        """
        changes = yield from self._pace.in_background(compare, self.snapshot, snapshot)
        last = self.result
        relit = Relit(changes.describe(), len(self._batches.nodes), patches=self.backend.light.count)
        if changes.nothing:
            self.result = replace(last, seconds={}, notes=["nothing changed"], iterations=0, relit=relit)
            return
        self.result = BakeResult(scene=self.backend.scene, capture=last.capture, relit=relit)
        self._stopwatch.seconds = self.result.seconds
        check_scene(snapshot, self.result)
        self._lamps_before = len(self.snapshot.lights)
        self.snapshot = snapshot
        captures = self._batches.captures
        had_emitters, had_gloss = self.backend.scene.emitter_count > 0, self.backend.scene.has_gloss
        had_faint_gloss = self.backend.scene.has_faint_gloss
        order = self.backend.scene.hierarchy.order
        with self._stopwatch("setup"):
            self._reporter.phase("upload")
            relit.hierarchy = self.backend.update(snapshot, changes)
        yield
        self._reporter.phase("light")
        if changes.shape:
            yield from self._reshape(changes.shape, relit.hierarchy, order, had_emitters)
        rebind = bool(changes.shape)
        if changes.world or changes.emission or changes.reflectance:
            rebind |= yield from self._resolve()
        rebind |= changes.reflectance and (had_gloss or self.backend.scene.has_gloss)  # rays are mirrored elsewhere
        rebind |= had_faint_gloss != self.backend.scene.has_faint_gloss
        if not rebind:
            rebind = not (yield from self._light_again(changes, had_emitters, live))
        if rebind:
            yield from self._light_anew()
        relit.kept_places = not rebind
        if not live:
            yield from self.show()
            yield from self.finish()
        relit.probes, relit.patches = len(self._batches.nodes), self.backend.light.count
        relit.probes_captured = self._batches.captures - captures
        relit.iterations = self.result.iterations

    def _light_again(self, changes: SceneChanges, had_emitters: bool, live: bool) -> Steps[bool]:
        """Light for patches that stay; returns whether they could."""
        light, relit = self.backend.light, self.result.relit
        assert relit is not None
        emitters = changes.emission and (had_emitters or self.backend.scene.emitter_count > 0)
        lamps = self._changed_lamps(changes)
        if changes.reflectance and self.backend.scene.has_faint_gloss:  # surfaces take light in another way
            light.patches.forget_couplings()
            lamps[:], emitters = True, self.backend.scene.emitter_count > 0
        if lamps.any() or changes.lights_removed or changes.world or emitters:
            relit.lights_direct = yield from self._stopwatch.steps("light", light.light_again(lamps, emitters))
            relit.patches_lit = light.count if relit.lights_direct or emitters else 0
            yield
        mirrors_change = self.backend.scene.has_gloss and (changes.any_light or changes.emission or changes.world)
        if changes.world or changes.emission or changes.reflectance or mirrors_change:
            if not (yield from self._stopwatch.steps("light", light.carry_again())):
                return False
            relit.patches_traced = light.count
            yield
        if mirrors_change:
            yield from self._batches.reflect_again()
        if not live:
            yield from judge_again(self._placement, self._batches, self.backend)
            if self._placement.is_outdated:
                return False
        relit.warm_start = yield from self._bounce(warm=self.settings.bounces is None)
        if emitters:
            self.backend.forget_emission()
        self._mark_unshown(emission=emitters and self.backend.scene.emitter_count > 0)
        return True

    def _changed_lamps(self, changes: SceneChanges) -> np.ndarray:
        """(lamp_count,) bool: lamps that differ; after them suns of the world, if it or the number of lamps does."""
        suns = self.backend.scene.lamp_count - len(changes.lights)
        moved_up = changes.lights_removed > 0 or len(changes.lights) > self._lamps_before
        return np.concatenate([changes.lights, np.full(suns, changes.world or moved_up)])

    def _light_anew(self) -> Steps[None]:
        """Light from texel surfaces on; probes that had been moved capture at home first, where placement begins."""
        relit = self.result.relit
        assert relit is not None
        yield from self._go_home()
        verdict = yield from self.see()
        yield from self.settle(verdict)
        relit.patches_lit = relit.patches_traced = self.backend.light.count
        relit.lights_direct = self.backend.scene.lamp_count

    def _resolve(self) -> Steps[bool]:
        """Materials of texels anew; returns whether patches must be found anew."""
        batches, rebind = self._batches, False
        if not batches.resident:
            batches.drop()
            return True
        for index in range(batches.count):
            surfaces = yield from batches.captured(index)
            with self._stopwatch("capture"):
                rebind |= resolve_again(self.backend, surfaces)
            yield
        return rebind

    def _reshape(self, shape: ShapeChange, hierarchy: str, old_order: np.ndarray, had_emitters: bool) -> Steps[None]:
        """Texel surfaces for triangles that changed: captured where the change can be seen, kept elsewhere."""
        backend, batches, placement = self.backend, self._batches, self._placement
        self._state = yield from self._stopwatch.steps("cull", self._pace.in_background(self._cull))
        again = placement.moved
        for index in range(batches.count) if batches.resident else ():
            surfaces = yield from batches.captured(index)
            with self._stopwatch("capture"):
                mine = slice(surfaces.first, surfaces.first + surfaces.count)
                again[mine] |= self._reached(surfaces, shape)
                if hierarchy == "rebuilt" or had_emitters or backend.scene.emitter_count:
                    numbers = new_numbers(shape, old_order, backend.scene.hierarchy.order)
                    resolve_again(backend, surfaces, numbers if hierarchy == "rebuilt" else None)
            yield
        again = np.isin(np.flatnonzero(self._state != CULLED), placement.nodes[again])
        with self._stopwatch("capture"):
            missing = batches.regroup(np.flatnonzero(self._state != CULLED))
            again[missing] = True
        yield from self._stand_at_home()
        yield from batches.capture_again(np.flatnonzero(again))
        yield

    def _reached(self, surfaces, shape: ShapeChange) -> np.ndarray:
        """(count,) bool of the probes of ``surfaces`` that can see the change."""
        spread = RASTER_SPREAD * 2.0 / self.settings.face if self.result.capture == "raster" else 0.0
        positions = self._placement.home + self._placement.step - self.grid.center
        old, new = (grown(boxes - self.grid.center, positions, spread) for boxes in (shape.old_boxes, shape.new_boxes))
        return probes_reached(self.backend, surfaces, old, new)
