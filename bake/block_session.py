# SPDX-License-Identifier: GPL-3.0-or-later
"""The bake of a grid in blocks (core/blocks.py): each is a VolumeBake of its own part, and they meet once, to vote.

    block by block: open, see ──► all votes together ──► block by block: settle, show ──► complete (CPU)

Nothing but the votes crosses the barrier, so a block may be given up before it and begun again behind it, to the same
bytes. That is done where the texel surfaces of all blocks do not fit the memory budget together.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.blocks import Block, cut
from ..core.clearance import Obstacles
from ..core.conventions import CULLED
from ..core.emitters import sampling_density
from ..core.orientation import ShellVote
from ..core.scene_changes import SceneChanges, compare
from ..core.snapshot import SceneSnapshot
from ..core.steps import Pace, Steps
from ..gpu_shaders.backend import probes_in_budget
from ..gpu_shaders.scene_textures import SceneTextures
from .bake_job import BakeJob
from .capture_choice import choose_capture
from .cull import cull
from .finish import complete, tell
from .outcome import BlockOutcome
from .result import BakeResult, Relit, Reporter, Silent, check_scene
from .session import BakeSession
from .stopwatch import Stopwatch
from .volume_bake import Part, VolumeBake


class BlockGround:
    """What the blocks of a bake have in common: scene and world on the GPU, ``state`` (P,) of the nodes before capture,
    ``capture``. ``blocks`` are those with probes that capture, in their order."""

    def __init__(
        self,
        job: BakeJob,
        state: np.ndarray,
        scene: SceneTextures,
        capture: str,
        pace: Pace | None = None,
    ):
        self.job, self.state, self.scene, self.capture, self._pace = job, state, scene, capture, pace
        blocks = cut(job.grid, job.settings.block)
        self.blocks = [block for block in blocks if len(blocks) == 1 or len(self.captured(block))]
        self._obstacles: Obstacles | None = None

    @property
    def object_count(self) -> int:
        return max(len(self.job.snapshot.object_names), 1)

    def captured(self, block: Block) -> np.ndarray:
        """(S,) nodes of ``block`` that capture, ascending."""
        nodes = block.nodes()
        return nodes[self.state[nodes] != CULLED]

    def open(self, block: Block) -> Steps[VolumeBake]:
        """``block``, with nothing captured yet."""
        state = np.full(self.job.grid.count, CULLED, np.uint8)
        state[self.captured(block)] = self.state[self.captured(block)]
        part = Part(block, state, self.capture, self.obstacles(block))
        bake = VolumeBake(self.job, Silent(), pace=self._pace, scene=self.scene, part=part)
        yield from bake.open()
        return bake

    def see(self, bake: VolumeBake) -> Steps[ShellVote]:
        """The votes of an open block."""
        votes = yield from bake.see()
        bake.backend.release_scratch()
        return votes

    def settle(self, bake: VolumeBake, verdict: ShellVote) -> Steps[BlockOutcome]:
        """The light of a block that has been seen."""
        yield from bake.settle(verdict)
        yield from bake.show()
        outcome = bake.outcome()
        bake.backend.release_scratch()
        return outcome

    def obstacles(self, block: Block) -> Obstacles:
        """What the probes of ``block`` keep clear of: triangles within two cells, no probe reaches others."""
        if self._obstacles is None:
            self._obstacles = Obstacles.of(self.job.grid, self.job.snapshot)
        if block.is_whole:
            return self._obstacles
        return self._obstacles.within(np.array(block.low) - 2, np.array(block.high) + 1)

    def follow_lamps(self, snapshot: SceneSnapshot, open_blocks: list[VolumeBake]) -> Steps[None]:
        """The same scene in the light of other lamps: ``open_blocks`` go back to where ``see`` begins."""
        self.job = replace(self.job, snapshot=snapshot)
        self.scene.set_lights(snapshot.lights, self.job.grid.center)
        for bake in open_blocks:
            bake.snapshot = snapshot
            yield from bake.start_over()


def only_lamps_differ(changes: SceneChanges) -> bool:
    """Do texel surfaces stay exactly what they are?"""
    other = changes.shape, changes.world, changes.emission, changes.reflectance, changes.materials, changes.images
    return not any(bool(change) for change in other)


class BlockSession:
    """A bake of several blocks with the face of a BakeSession. A relight bakes anew; where only lamps differ, with the
    texel surfaces that are there."""

    backend = None  # there is one a block

    def __init__(self, job: BakeJob, reporter: Reporter, result: BakeResult | None = None, *, pace: Pace | None = None):
        self._job, self.snapshot, self.grid, self.settings = job, job.snapshot, job.grid, job.settings
        self.result = result or BakeResult()
        self._reporter = reporter
        self._edits = job.probe_edits
        self._pace = pace or Pace(None)
        self._stopwatch = Stopwatch(self.result.seconds)
        self.unshown = np.zeros(0, bool)  # probes are never shown one by one
        self.positions = np.zeros((0, 3))
        self._open: dict[int, VolumeBake] = {}
        self._given_up = 0  # probes captured by blocks that are gone

    @property
    def open_blocks(self) -> list[VolumeBake]:
        """Those that are on the GPU, in their order."""
        return [self._open[index] for index in sorted(self._open)]

    def bake(self) -> Steps[None]:
        """The whole bake in steps; fills ``result`` as it goes and completes it with the last step.

        Raises:
            InputError: the scene has no surface, or the grid does not fit the GPU.
        """
        self.result.warnings.clear()
        check_scene(self.snapshot, self.result)
        culling = self._pace.meanwhile(cull, self.snapshot, self.grid, self.settings, self._edits)
        self._reporter.phase("upload")
        density = yield from self._pace.in_background(sampling_density, self.snapshot, self.grid)
        making = SceneTextures.make(self.snapshot, self.grid.center, density, self._pace)
        scene = yield from self._stopwatch.steps("setup", making)
        state = yield from self._stopwatch.steps("cull", culling)
        probes = int((state != CULLED).sum())
        capture, reason = choose_capture(self.settings, scene.triangle_count, probes)
        self.result.scene, self.result.capture = scene, capture
        self.result.notes.append(reason)
        self._ground = BlockGround(replace(self._job, snapshot=self.snapshot), state, scene, capture, self._pace)
        self._keeps = probes <= probes_in_budget(self.settings)
        yield from self._light()

    def _light(self) -> Steps[None]:
        """From the first capture to the field."""
        ground = self._ground
        probes = [len(ground.captured(block)) for block in ground.blocks]
        if not self._keeps:
            self.result.notes.append(
                f"texel surfaces of {sum(probes)} probes exceed the memory budget of {self.settings.memory_mib} MiB: "
                f"{len(probes)} blocks take turns, and each captures twice"
            )
        verdict = ShellVote(ground.object_count)
        self._reporter.phase("capture", sum(probes))
        for block in ground.blocks:
            verdict.merge((yield from self._see(block)))
        self._reporter.phase("light", sum(probes))
        outcomes = {}
        for block in reversed(ground.blocks):  # the last one is still on the GPU
            outcomes[block.index] = yield from self._settle(block, verdict)
        self._outcomes = [outcomes[index] for index in sorted(outcomes)]
        tell(self.result, self._outcomes)
        work = self._pace.in_background(
            complete,
            self.result,
            self.grid,
            self.settings,
            ground.state,
            self._edits.offset,
            self._outcomes,
            self.snapshot.name,
        )
        yield from self._stopwatch.steps("light", work)

    def _see(self, block: Block) -> Steps[ShellVote]:
        if block.index not in self._open:
            if not self._keeps:
                self._give_up()
            self._open[block.index] = yield from self._ground.open(block)
        bake = self._open[block.index]
        votes = yield from self._ground.see(bake)
        self._count(bake)
        return votes

    def _settle(self, block: Block, verdict: ShellVote) -> Steps[BlockOutcome]:
        if block.index not in self._open:
            yield from self._see(block)
        bake = self._open[block.index]
        outcome = yield from self._ground.settle(bake, verdict)
        self._count(bake)
        return outcome

    def _count(self, bake: VolumeBake) -> None:
        """Adds the block's seconds to those of all."""
        self._reporter.advance(len(bake.nodes))
        for phase, seconds in bake.result.seconds.items():
            self.result.seconds[phase] = self.result.seconds.get(phase, 0.0) + seconds
            bake.result.seconds[phase] = 0.0

    def _give_up(self) -> None:
        self._given_up = self._captured
        self._open.clear()

    @property
    def _captured(self) -> int:
        """Probes captured so far."""
        return self._given_up + sum(bake.captures for bake in self._open.values())

    def show(self, slots: np.ndarray | None = None) -> Steps[None]:
        """Nothing is left to show after a bake or relight."""
        yield

    def finish(self) -> Steps[None]:
        """The field is complete after a bake or relight."""
        yield

    def relight(self, snapshot: SceneSnapshot, live: bool = False) -> Steps[None]:
        """Brings the bake to ``snapshot``, another state of the scene, in steps; ``result`` is a new one, with
        ``relit`` and, ``live`` or not, the whole field."""
        changes = yield from self._pace.in_background(compare, self.snapshot, snapshot)
        last, captured = self.result, self._captured
        probes, patches = self._counts()
        relit = Relit(changes.describe(), probes, patches=patches)
        if changes.nothing:
            self.result = replace(last, seconds={}, notes=["nothing changed"], iterations=0, relit=relit)
            return
        self.snapshot = snapshot
        self.result = BakeResult(scene=last.scene, capture=last.capture, relit=relit)
        self._stopwatch.seconds = self.result.seconds
        if only_lamps_differ(changes):
            check_scene(snapshot, self.result)
            yield from self._ground.follow_lamps(snapshot, self.open_blocks)
            yield from self._light()
        else:
            self._give_up()
            relit.hierarchy = "rebuilt"
            yield from self.bake()
        relit.probes, relit.patches = self._counts()
        relit.patches_lit = relit.patches_traced = relit.patches
        relit.lights_direct = self._ground.scene.lamp_count
        relit.kept_places = False
        relit.probes_captured = self._captured - captured
        relit.iterations = self.result.iterations

    def _counts(self) -> tuple[int, int]:
        """Probes that capture, and patches."""
        return sum(len(o.nodes) for o in self._outcomes), sum(o.patches for o in self._outcomes)


AnySession = BakeSession | BlockSession


def open_session(
    job: BakeJob, reporter: Reporter, result: BakeResult | None = None, *, pace: Pace | None = None
) -> AnySession:
    """The session of a job, in one block or in several."""
    kind = BakeSession if job.grid.count <= job.settings.block else BlockSession
    return kind(job, reporter, result, pace=pace)
