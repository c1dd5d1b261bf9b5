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

from ..core import clearance, dilation, gradients
from ..core.change_reach import RASTER_SPREAD, grown
from ..core.conventions import ACTIVE, CULLED, INVALID
from ..core.errors import InputError
from ..core.field import Field
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.scene_changes import SceneChanges, ShapeChange, compare
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..core.steps import Pace, Steps
from ..gpu_shaders.backend import GpuBackend
from ..gpu_shaders.change_pass import new_numbers, probes_reached, resolve_again
from ..gpu_shaders.scene_textures import SceneTextures
from .batches import Batches
from .capture_choice import choose_capture
from .convergence import MANY_MODES, Convergence
from .deringing import dering_field
from .placement import Placement, cull, judge_again, place
from .result import BakeResult, Relit, Reporter, check_scene
from .stopwatch import Stopwatch

_SMALL_CHANGE = 0.5  # of the light that bounces begin with: above, the light before is no better start than the dark


class BakeSession:
    """``bake`` once, then ``relight`` as often as the scene changes; ``result`` is that of the last one. The bake fills
    the one given.

    ``edits``: probes that the user switched off or moved. Moved ones capture where they were put and are not relocated.
    ``stopwatch``: one that measures more than seconds by phase.
    """

    def __init__(
        self,
        snapshot: SceneSnapshot,
        grid: Grid,
        settings: BakeSettings,
        reporter: Reporter,
        edits: ProbeEdits | None = None,
        result: BakeResult | None = None,
        stopwatch: Stopwatch | None = None,
        pace: Pace | None = None,
        scene: SceneTextures | None = None,
    ):
        """``pace``: how much is done in a step; without one steps are as large as they come. ``scene``: ``snapshot`` on
        the GPU, from another session of the same grid."""
        self.snapshot = snapshot
        self.grid = grid
        self.settings = settings
        self.result = result or BakeResult()
        self._reporter = reporter
        self._edits = edits or ProbeEdits.none(grid)
        self._stopwatch = stopwatch or Stopwatch({})
        self._stopwatch.seconds = self.result.seconds
        self._pace = pace or Pace(None)
        self._obstacles_of: tuple[SceneSnapshot | None, np.ndarray] = (None, np.zeros((0, 3, 3)))
        self.unshown = np.zeros(0, bool)  # (S,): probes whose light has changed since ``show`` was there
        self._scene = scene

    # The bake
    # ------------------------------------------------------------------------------------------------------------------

    def bake(self) -> Steps[None]:
        """The whole bake in steps; fills ``result`` as it goes and completes it with the last step.

        Raises:
            InputError: the scene has no surface, or the grid does not fit the GPU.
        """
        result = self.result
        check_scene(self.snapshot, result)
        self._reporter.phase("cull")
        self._state = yield from self._stopwatch.steps(
            "cull", self._pace.in_background(cull, self.snapshot, self.grid, self.settings, self._edits)
        )
        yield
        self._reporter.phase("upload")
        making = GpuBackend.make(self.snapshot, self.grid, self.settings, self._pace, self._scene)
        self.backend = yield from self._stopwatch.steps("setup", making)
        yield
        result.scene = self.backend.scene
        result.capture, reason = choose_capture(
            self.settings, self.backend.scene.triangle_count, int((self._state == ACTIVE).sum())
        )
        result.notes.append(reason)
        nodes = np.flatnonzero(self._state == ACTIVE)
        self._batches = Batches(self.backend, nodes, result.capture, self._stopwatch, self._pace)
        if not self._batches.resident:
            result.notes.append(
                f"texel surfaces of {len(self._batches.nodes)} probes exceed the memory budget of "
                f"{self.settings.memory_mib} MiB: they are captured again whenever they are needed"
            )
        yield from self._stand_at_home()
        yield from self._light_from_texels()
        yield from self.show()
        yield from self.finish()

    def _obstacles(self) -> np.ndarray:
        """What probes keep clear of; found once per state of the scene."""
        if self._obstacles_of[0] is not self.snapshot:
            self._obstacles_of = (self.snapshot, clearance.obstacles(self.grid, self.snapshot))
        return self._obstacles_of[1]

    def _stand_at_home(self) -> Steps[None]:
        """Puts the probes of all slots where they belong, with no light yet."""
        nodes = self._batches.nodes

        def at_home() -> Placement:
            return Placement.at_home(self.grid, nodes, self._edits.offset, self._obstacles())

        self._placement = yield from self._stopwatch.steps("cull", self._pace.in_background(at_home))
        self.backend.set_probes(self._batches.nodes, self._placement.home)
        self.backend.allocate_field()

    def _light_from_texels(self) -> Steps[None]:
        """Everything after capture, from nothing: patches, placement, bounces."""
        result, batches = self.result, self._batches
        self._reporter.phase("capture", len(batches.nodes))
        for index in range(batches.count):
            surfaces = yield from batches.bound(index)
            self._reporter.advance(surfaces.count)
            yield
        yield from place(self._placement, batches, self.backend, self.grid, self._obstacles)
        moved = int(self._placement.moved.sum())
        if moved:
            result.notes.append(f"{moved} probes in or behind walls were moved out, at most half a cell")
        self._reporter.phase("light")
        yield from self._stopwatch.steps("light", self.backend.light.connect())
        result.notes.append(f"light bounces between {self.backend.light.count} patches of surface")
        yield
        yield from self._bounce(warm=False)
        self._mark_unshown(emission=self.backend.scene.emitter_count > 0)

    def light_with(self, settings: BakeSettings) -> Steps[None]:
        """Lights what was baked once more with other ``settings`` of light, its seed among them, in steps: probes stay
        where they are and see what they saw. ``result`` is a new one."""
        self.settings = self.backend.settings = settings
        self.result = BakeResult(scene=self.backend.scene, capture=self.result.capture)
        self._stopwatch.seconds = self.result.seconds
        self._batches.unbind()
        self.backend.forget_patches()
        self.backend.forget_emission()
        for index in range(self._batches.count):
            yield from self._batches.bound(index)
        yield from self._stopwatch.steps("light", self.backend.light.light_new_patches())
        yield from self._stopwatch.steps("light", self.backend.light.connect())
        yield from self._bounce(warm=False)
        self._mark_unshown(emission=self.backend.scene.emitter_count > 0)
        yield from self.show()
        yield from self.finish()

    def _bounce(self, warm: bool) -> Steps[None]:
        """Iterates until the light has settled, from the dark or from the light before."""
        convergence = Convergence(self.settings.bounces, self.settings.tolerance)
        while not convergence.done:
            with self._stopwatch("light"):
                energy, change, overlap, luminance = self.backend.light.iterate(
                    bounce=warm or convergence.iterations > 0
                )
                self.result.energy.append(luminance)
                factor = convergence.add(energy, change, overlap)
                self._reporter.advance(1)
                if factor == MANY_MODES:
                    self.backend.light.extrapolate_modes()
                elif factor:
                    self.backend.light.extrapolate(factor)
            yield
        self.result.iterations = convergence.iterations
        self.result.converged = convergence.converged
        self.result.missing = convergence.missing
        self.result.change = convergence.changes
        self.result.notes.append(convergence.reason)

    def _mark_unshown(self, emission: bool) -> None:
        """The light of all probes has changed; with ``emission``, also what they see of sampled emitters."""
        self.unshown = np.ones(len(self._batches.nodes), bool)
        self._emission_unknown = np.full(len(self._batches.nodes), emission)

    @property
    def positions(self) -> np.ndarray:
        """(S, 3) world metres: where probes capture."""
        return self._placement.home + self._placement.step

    def show(self, slots: np.ndarray | None = None) -> Steps[None]:
        """The field of the probes in ``slots`` (L,), or of all, by the light of patches, or by a gather."""
        batches, backend, kind = self._batches, self.backend, "gather" if self.settings.gather else "project"
        slots = np.arange(len(batches.nodes)) if slots is None else slots
        self._reporter.phase(kind, len(slots))
        for index in range(batches.count):
            mine = batches.slots_of(index, slots)
            if not len(mine):
                continue
            surfaces = yield from batches.bound(index)

            def project(start: int, number: int, mine=mine, surfaces=surfaces) -> None:
                some = mine[start : start + number]
                blind = some[self._emission_unknown[some]]
                if len(blind):
                    backend.find_emission(surfaces, blind - surfaces.first)
                    self._emission_unknown[blind] = False
                (backend.gather if self.settings.gather else backend.project)(surfaces, some - surfaces.first)
                self.unshown[some] = False
                self._reporter.advance(number)

            yield from self._stopwatch.steps("light", self._pace.portions(kind, len(mine), project))

    def finish(self) -> Steps[None]:
        """Reads the field back and completes it for probes without light of their own."""
        result, placement, backend = self.result, self._placement, self.backend
        state, all_inside = placement.states(self._state)
        if all_inside:
            result.warnings.append(
                f"{self.grid.name}: every probe sees mostly back faces without light; they are baked all the same. "
                "Flip the normals of what surrounds the volume, or move it out of solid geometry"
            )
        with self._stopwatch("light"):
            field = result.field = Field.empty(self.grid, self.settings.bands)
            nodes = placement.nodes
            field.state[:] = state
            field.validity[nodes] = 1.0 - placement.shares[:, 0]
            field.offset[:] = self._edits.offset
            field.offset[nodes] = placement.home + placement.step - self.grid.positions()[nodes]
            field.coefficients[nodes] = backend.read_field()
            field.depth[nodes] = backend.read_depth()
            field.gradient[nodes] = backend.read_gradient()
        yield
        notes = yield from self._stopwatch.steps("light", self._pace.in_background(self._complete, field))
        result.notes += notes
        result.counts = {"total": self.grid.count} | {
            name: int((state == value).sum())
            for name, value in (("active", ACTIVE), ("culled", CULLED), ("invalid", INVALID))
        }
        if not np.isfinite(field.coefficients).all():
            raise InputError(
                f"scene '{self.snapshot.name}' sends light that is not finite; look for lights or emission beyond 1e30"
            )

    def _complete(self, field: Field) -> list[str]:
        """Light of nodes that have none of their own, and limits; returns what to say about it."""
        active = field.state == ACTIVE
        field.coefficients = dilation.fill(self.grid, field.coefficients, active)
        field.gradient[~active] = 0.0
        field.gradient = gradients.limited(self.grid, field.gradient, field.coefficients)
        return [dering_field(field)] if self.settings.deringing else []

    # Relighting
    # ------------------------------------------------------------------------------------------------------------------

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
        had_emitters = self.backend.scene.emitter_count > 0
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
        before = light.source()
        emitters = changes.emission and (had_emitters or self.backend.scene.emitter_count > 0)
        lamps = self._changed_lamps(changes)
        if lamps.any() or changes.lights_removed or changes.world or emitters:
            relit.lights_direct = yield from self._stopwatch.steps("light", light.light_again(lamps, emitters))
            relit.patches_lit = light.count if relit.lights_direct or emitters else 0
            yield
        if changes.world or changes.emission or changes.reflectance:
            if not (yield from self._stopwatch.steps("light", light.carry_again())):
                return False
            relit.patches_traced = light.count
            yield
        if not live:
            yield from judge_again(self._placement, self._batches, self.backend)
            if self._placement.is_outdated:
                return False
        small = light.changed_source(before) < _SMALL_CHANGE
        relit.warm_start = bool(self.settings.bounces is None and small)
        yield from self._bounce(relit.warm_start)
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
        moved = np.flatnonzero(self._placement.moved)
        yield from self._stand_at_home()
        self._batches.unbind()
        yield from self._batches.capture_again(moved)
        self.backend.forget_patches()
        yield
        yield from self._light_from_texels()
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
        self._state = yield from self._stopwatch.steps(
            "cull", self._pace.in_background(cull, self.snapshot, self.grid, self.settings, self._edits)
        )
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
        again = np.isin(np.flatnonzero(self._state == ACTIVE), placement.nodes[again])
        with self._stopwatch("capture"):
            missing = batches.regroup(np.flatnonzero(self._state == ACTIVE))
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
