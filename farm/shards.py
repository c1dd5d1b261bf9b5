# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs shards in this process, which has Blender and a GPU. What one shard left on the GPU serves the next.

Scene, hierarchy and blocks stay as long as they serve: texel surfaces between the iterations as far as the memory
budget goes, and between frames where only lamps differ. None of it changes a byte of what is written.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from ..bake.bake_job import BakeJob
from ..bake.block_session import BlockGround
from ..bake.volume_bake import VolumeBake
from ..core.emitters import sampling_density
from ..core.errors import InputError
from ..core.orientation import ShellVote
from ..core.steps import run
from ..gpu_shaders.backend import probes_in_budget
from ..gpu_shaders.context import device_description
from ..gpu_shaders.scene_textures import SceneTextures
from . import container
from .job import Job, Shard
from .outcomes import describe_outcomes
from .scene_file import STILL, SceneReader
from .settings import settings_of, volume_of
from .votes import read_vote


@dataclass
class _Open:
    """A block on the GPU. ``vote``: it has been seen; ``is_spent``: it was settled, its probes may stand elsewhere."""

    bake: VolumeBake
    vote: ShellVote | None = None
    is_spent: bool = False


@dataclass
class _Place:
    """A volume at a frame on the GPU, with blocks by index."""

    group: tuple[int, int]
    ground: BlockGround
    open: dict[int, _Open]


class ShardRunner:
    """Shards of one job. Needs a GPU context.

    Raises:
        InputError: this device is another than that of the plan, whose bytes it would not give.
    """

    def __init__(self, job: Job):
        self.job = job
        self.settings = settings_of(job.plan)
        self._reader = SceneReader(job.objects)
        self._place: _Place | None = None
        self._captured = 0  # probes, by blocks that were given up
        device = device_description()
        if device != job.plan["device"]:
            raise InputError(
                f"this machine's device is '{device}', the plan was made for '{job.plan['device']}': results would "
                "not fit together. Use machines of one kind, or plan on this one"
            )

    def run(self, iteration: int, number: int) -> dict:
        """Makes the output of shard ``number`` where it is not there yet; returns what happened.

        Raises:
            InputError: iteration 1 was asked for before the barrier.
        """
        started = time.perf_counter()
        shard = self.job.shard(number)
        path, made, captures = self.job.output(iteration, shard), False, 0
        if path is None:
            if iteration == 1 and self.job.verdict(shard.group) is None:
                raise InputError(
                    f"{self.job.describe(shard)} needs the votes of iteration 0: run 'gridlight farm merge "
                    f"{self.job.folder} --iteration 0' first"
                )
            before = self._captures
            path, made = (self._light if iteration else self._vote)(shard), True
            captures = self._captures - before
        seconds = round(time.perf_counter() - started, 3)
        if made:
            self.job.event(
                "done", iteration=iteration, shard=number, seconds=seconds, captured=captures, file=path.name[:21]
            )
        return {"iteration": iteration, "shard": number, "made": made, "seconds": seconds, "captured": captures}

    def _vote(self, shard: Shard) -> Path:
        place = self._stand_on(shard.group)
        votes = ShellVote(place.ground.object_count)
        for index in shard.blocks:
            votes.merge(self._see(place, index))
        header = {"any_light": bool(votes.any_light), "sees_light": bool(votes.sees_light)}
        return self.job.write_output(0, shard, header, {"behind": votes.behind, "lit": votes.lit})

    def _light(self, shard: Shard) -> Path:
        place = self._stand_on(shard.group)
        path = self.job.verdict(shard.group)
        verdict = read_vote(path)
        outcomes = {}
        for index in reversed(shard.blocks):  # the last one of iteration 0 may still be here
            self._see(place, index)
            block = place.open[index]
            block.is_spent = True
            outcomes[index] = run(place.ground.settle(block.bake, verdict))
        header, arrays = describe_outcomes(outcomes)
        return self.job.write_output(1, shard, {**header, "verdict": container.hash_in(path)}, arrays)

    # What is on the GPU
    # ------------------------------------------------------------------------------------------------------------------

    def _stand_on(self, group: tuple[int, int]) -> _Place:
        """The volume and frame ``group`` on the GPU, by way of what is there where that serves."""
        place = self._place
        if place is not None and place.group == group:
            return place
        snapshot = self._reader.read(self.job.plan["frames"][group[0]]["scene"])
        if place is not None and self._stands_still(place.group, group):
            run(place.ground.follow_lamps(snapshot, [block.bake for block in place.open.values()]))
            for block in place.open.values():
                block.vote, block.is_spent = None, False
            place.group = group
            return place
        for index in list(place.open) if place else ():
            self._give_up(place, index)
        self._place = place = None  # the memory of what was there goes before the next needs it
        grid, state, edits = volume_of(self.job, group)
        scene = SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
        capture = self.job.plan["frames"][group[0]]["volumes"][group[1]]["capture"]
        ground = BlockGround(BakeJob(snapshot, grid, self.settings, edits), state, scene, capture)
        self._place = _Place(group, ground, {})
        return self._place

    def _stands_still(self, before: tuple[int, int], after: tuple[int, int]) -> bool:
        """Do only lamps differ between the two?"""
        old, new = (self.job.plan["frames"][frame] for frame, _volume in (before, after))
        return old["volumes"][before[1]] == new["volumes"][after[1]] and all(
            old["scene"][part] == new["scene"][part] for part in (*STILL, "world")
        )

    def _see(self, place: _Place, index: int) -> ShellVote:
        """The votes of block ``index``, which is then ready to be settled. Others are given up where the memory budget
        asks for it, the oldest first."""
        if index not in place.open:
            block = next(block for block in place.ground.blocks if block.index == index)
            room = probes_in_budget(self.settings) - len(place.ground.captured(block))
            for other in list(place.open):
                if sum(len(held.bake.nodes) for held in place.open.values()) > max(room, 0):
                    self._give_up(place, other)
            place.open[index] = _Open(run(place.ground.open(block)))
        held = place.open[index]
        if held.is_spent:
            run(held.bake.start_over())
            held.vote, held.is_spent = None, False
        if held.vote is None:
            held.vote = run(place.ground.see(held.bake))
        return held.vote

    def _give_up(self, place: _Place, index: int) -> None:
        self._captured += place.open.pop(index).bake.captures

    @property
    def _captures(self) -> int:
        """Probes captured so far."""
        held = self._place.open.values() if self._place else ()
        return self._captured + sum(block.bake.captures for block in held)
