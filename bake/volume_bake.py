# SPDX-License-Identifier: GPL-3.0-or-later
"""One volume's bake on the GPU, from its scene to its field, in steps: generators that yield between pieces of work.

``bake`` is the whole. A grid that is baked in blocks (core/blocks.py) has one session a block, whose steps
block_session.py takes apart: ``open``, ``see`` up to the votes on shells, ``settle`` by the votes of all blocks and
``show``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.blocks import Block
from ..core.clearance import Obstacles
from ..core.conventions import ACTIVE, CULLED
from ..core.extrapolation import Sums
from ..core.orientation import ShellVote, inside_solid
from ..core.settings import BakeSettings
from ..core.steps import Pace, Steps
from ..gpu_shaders.backend import GpuBackend
from ..gpu_shaders.scene_textures import SceneTextures
from .bake_job import BakeJob
from .batches import Batches
from .capture_choice import choose_capture
from .convergence import MANY_MODES, Convergence
from .cull import cull
from .finish import complete
from .outcome import BlockOutcome
from .placement import Placement, place, vote
from .result import BakeResult, Reporter, check_scene
from .stopwatch import Stopwatch

_SMALL_CHANGE = 0.25  # of light: where its sources changed by more, the light before is no better start than the dark


@dataclass(frozen=True)
class Part:
    """A block that is baked by a session of its own."""

    block: Block
    state: np.ndarray  # (P,) before capture: nodes outside the block are culled
    capture: str  # "raster" or "trace"
    obstacles: Obstacles  # what its probes keep clear of


class VolumeBake:
    """``result`` is filled by ``bake``; it may be given."""

    def __init__(
        self,
        job: BakeJob,
        reporter: Reporter,
        result: BakeResult | None = None,
        *,
        stopwatch: Stopwatch | None = None,
        pace: Pace | None = None,
        scene: SceneTextures | None = None,
        part: Part | None = None,
    ):
        """
        Args:
            stopwatch: one that measures more than seconds by phase.
            pace: how much is done in a step; without one steps are as large as they come.
            scene: the job's scene on the GPU, from another session of the same grid.
            part: bake this part of the grid, for block_session.py.
        """
        self.snapshot, self.grid, self.settings = job.snapshot, job.grid, job.settings
        self.result = result or BakeResult()
        self._reporter = reporter
        self._edits = job.probe_edits
        self._stopwatch = stopwatch or Stopwatch({})
        self._stopwatch.seconds = self.result.seconds
        self._pace = pace or Pace(None)
        self.unshown = np.zeros(0, bool)  # (S,): probes whose light has changed since ``show`` was there
        self._scene = scene
        self._part = part

    # The bake
    # ------------------------------------------------------------------------------------------------------------------

    def bake(self) -> Steps[None]:
        """The whole bake in steps; fills ``result`` as it goes and completes it with the last step.

        Raises:
            InputError: the scene has no surface, or the grid does not fit the GPU.
        """
        check_scene(self.snapshot, self.result)
        yield from self.open()
        verdict = yield from self.see()
        yield from self.settle(verdict)
        yield from self.show()
        yield from self.finish()

    def open(self) -> Steps[None]:
        """What a bake begins with: the scene on the GPU, and which probes capture, at home."""
        result = self.result
        placing = self._pace.meanwhile(self._cull_and_place)  # beside the scene's way to the GPU
        self._reporter.phase("upload")
        block = None if self._part is None else self._part.block
        making = GpuBackend.make(self.snapshot, self.grid, self.settings, self._pace, self._scene, block)
        self.backend = yield from self._stopwatch.steps("setup", making)
        yield
        self._state, placement = yield from self._stopwatch.steps("cull", placing)
        result.scene = self.backend.scene
        if self._part is None:
            triangles, probes = self.backend.scene.triangle_count, int((self._state != CULLED).sum())
            result.capture, reason = choose_capture(self.settings, triangles, probes)
        else:
            result.capture, reason = self._part.capture, f"capture by {self._part.capture}, as for all blocks"
        result.notes.append(reason)
        nodes = np.flatnonzero(self._state != CULLED)
        self._batches = Batches(self.backend, nodes, result.capture, self._stopwatch, self._pace)
        if not self._batches.resident:
            result.notes.append(
                f"texel surfaces of {len(self._batches.nodes)} probes exceed the memory budget of "
                f"{self.settings.memory_mib} MiB: they are captured again whenever they are needed"
            )
        self._stand(placement)

    def _cull_and_place(self) -> tuple[np.ndarray, Placement]:
        state = self._cull()
        return state, self._at_home(np.flatnonzero(state != CULLED))

    def _cull(self) -> np.ndarray:
        """(P,) uint8 states before capture, see ``cull``."""
        if self._part is not None:
            return self._part.state
        return cull(self.snapshot, self.grid, self.settings, self._edits)

    def _obstacles(self) -> Obstacles:
        """What probes keep clear of."""
        if self._part is not None:
            return self._part.obstacles
        return Obstacles.of(self.grid, self.snapshot)

    def _stand_at_home(self) -> Steps[None]:
        """Puts the probes of all slots where they belong, with no light yet."""
        work = self._pace.in_background(self._at_home, self._batches.nodes)
        self._stand((yield from self._stopwatch.steps("cull", work)))

    def _at_home(self, nodes: np.ndarray) -> Placement:
        return Placement.at_home(self.grid, nodes, self._edits.offset, self._obstacles())

    def _stand(self, placement: Placement) -> None:
        self._placement = placement
        self.backend.set_probes(placement.nodes, placement.home)
        self.backend.allocate_field()

    def see(self) -> Steps[ShellVote]:
        """Captures, finds patches, lights them directly; returns what the probes say about objects' back faces."""
        batches = self._batches
        self._reporter.phase("capture", len(batches.nodes))
        for index in range(batches.count):
            surfaces = yield from batches.bound(index)
            self._reporter.advance(surfaces.count)
            yield
        yield from self._stopwatch.steps("light", self.backend.light.light_new_patches())
        return (yield from vote(batches, self.backend, for_others=self._part is not None))

    def settle(self, verdict: ShellVote) -> Steps[None]:
        """Everything after ``see`` but ``show``, by what all probes said: placement and bounces."""
        result = self.result
        yield from place(self._placement, self._batches, self.backend, self.grid, self._obstacles, verdict)
        moved = int(self._placement.moved.sum())
        if moved:
            result.notes.append(f"{moved} probes in or behind walls were moved out, at most half a cell")
        yield from self._overlook_bystanders()
        self._reporter.phase("light")
        yield from self._stopwatch.steps("light", self.backend.light.connect())
        result.notes.append(f"light bounces between {self.backend.light.count} patches of surface")
        yield
        yield from self._bounce(warm=False)
        self._mark_unshown(emission=self.backend.scene.emitter_count > 0)

    def _overlook_bystanders(self) -> Steps[None]:
        """What only probes inside solids or in the open see does not count when it is asked whether light has
        settled: in a closed hollow of white walls it never does."""
        placement = self._placement
        buried = inside_solid(placement.shares, placement.light_elsewhere)
        judges = ~buried & (self._state[placement.nodes] == ACTIVE)
        if judges.all() or not judges.any():
            return
        patches = self.backend.light.patches
        patches.forget_seen()
        for index in range(self._batches.count):
            surfaces = yield from self._batches.bound(index)
            mine = self._batches.slots_of(index, np.flatnonzero(judges))
            if len(mine):
                layers = mine - surfaces.first
                patches.mark_seen(surfaces.textures, self.settings.face, layers, self.backend.gloss.defines)
            yield

    @property
    def nodes(self) -> np.ndarray:
        """(S,) grid indices of the probes that capture."""
        return self._batches.nodes

    def start_over(self) -> Steps[None]:
        """Back to where ``see`` begins, with the texel surfaces that are there."""
        self._begin_result()
        yield from self._go_home()

    def _begin_result(self) -> None:
        """A new ``result`` for the same scene on the GPU, seen the same way."""
        self.result = BakeResult(scene=self.backend.scene, capture=self.result.capture)
        self._stopwatch.seconds = self.result.seconds

    def _go_home(self) -> Steps[None]:
        """Forgets patches; probes that had been moved capture at home, where placement begins."""
        moved = np.flatnonzero(self._placement.moved)
        yield from self._stand_at_home()
        self._batches.unbind()
        yield from self._batches.capture_again(moved)
        self.backend.forget_patches()
        yield

    def light_with(self, settings: BakeSettings) -> Steps[None]:
        """Lights what was baked once more with other ``settings`` of light, its seed among them, in steps: probes stay
        where they are and see what they saw. ``result`` is a new one."""
        self.settings = self.backend.settings = settings
        self._begin_result()
        self._batches.unbind()
        self.backend.forget_patches()
        self.backend.forget_emission()
        for index in range(self._batches.count):
            yield from self._batches.bound(index)
        yield from self._stopwatch.steps("light", self.backend.light.light_new_patches())
        yield from self._overlook_bystanders()
        yield from self._stopwatch.steps("light", self.backend.light.connect())
        yield from self._bounce(warm=False)
        self._mark_unshown(emission=self.backend.scene.emitter_count > 0)
        yield from self.show()
        yield from self.finish()

    def _bounce(self, warm: bool) -> Steps[bool]:
        """Iterates until the light has settled, from the dark, or if ``warm`` from the light before, unless that is no
        better start. Returns whether it was."""
        convergence = Convergence(self.settings.bounces, self.settings.tolerance, warm)
        while not convergence.done:
            for ahead in range(convergence.until_decision):
                with self._stopwatch("light"):
                    self.backend.light.iterate(bounce=warm or convergence.iterations + ahead > 0)
                yield
            with self._stopwatch("light"):
                differences = self.backend.light.differences()
                first = differences[0][0]
                # The first step from settled light is by how much its sources changed.
                if warm and not convergence.iterations and not first.change <= _SMALL_CHANGE**2 * first.energy:
                    warm = False
                    continue
                self._judge(convergence, differences)
            yield
        self.result.iterations = convergence.iterations
        self.result.converged = convergence.converged
        self.result.missing = convergence.missing
        self.result.change = convergence.changes
        self.result.notes.append(convergence.reason)
        self._reason = convergence.reason
        self._hollow_nodes = np.zeros(0, np.int64)
        if convergence.has_hollows:
            yield from self._find_hollows()
        return warm

    def _judge(self, convergence: Convergence, differences: list[tuple[Sums, float]]) -> None:
        """Tells ``convergence`` of the last iterations, and does what it says."""
        factor = 0.0
        for number, (sums, luminance) in enumerate(differences, start=1):
            if convergence.done:
                return
            self.result.energy.append(luminance)
            factor = convergence.add(sums, is_newest=number == len(differences))
            self._reporter.advance(1)
        if factor == MANY_MODES:
            self.backend.light.extrapolate_modes()
        elif factor:
            self.backend.light.extrapolate(factor)

    def _find_hollows(self) -> Steps[None]:
        """Which active probes see mostly hollows that are still filling with light."""
        found = []
        for index in range(self._batches.count):
            surfaces = yield from self._batches.bound(index)
            layers = np.arange(surfaces.count)
            shares = self.backend.light.slow_shares(surfaces.textures["albedo"], self.settings.face, layers)
            found.append(self._batches.nodes[surfaces.first + layers[shares > 0.5]])
            yield
        nodes = np.concatenate(found)
        self._hollow_nodes = nodes[self._state[nodes] == ACTIVE]

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
        with self._stopwatch("light"):
            outcome = self.outcome()
        yield
        work = self._pace.in_background(
            complete,
            self.result,
            self.grid,
            self.settings,
            self._state,
            self._edits.offset,
            [outcome],
            self.snapshot.name,
        )
        yield from self._stopwatch.steps("light", work)

    def outcome(self) -> BlockOutcome:
        """What the probes hold, read back. Waits for the GPU."""
        placement, result = self._placement, self.result
        return BlockOutcome(
            placement.nodes,
            (self.positions - self.grid.positions()[placement.nodes]).astype(np.float32),
            placement.shares.astype(np.float32),
            self.backend.read_field(),
            self.backend.read_depth(),
            self.backend.read_gradient(),
            self._hollow_nodes,
            int(placement.moved.sum()),
            self.backend.light.count,
            result.iterations,
            result.converged,
            result.missing,
            self._reason,
            tuple(result.energy),
            tuple(result.change),
        )

    @property
    def captures(self) -> int:
        """Probes captured so far."""
        return self._batches.captures
