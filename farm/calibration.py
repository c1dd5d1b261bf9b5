# SPDX-License-Identifier: GPL-3.0-or-later
"""How long blocks take on this device: two small ones are baked, and time is taken as a line through both."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import replace

from ..bake.bake_job import BakeJob
from ..bake.block_session import BlockGround
from ..bake.capture_choice import choose_capture
from ..bake.cull import cull
from ..core.blocks import Block
from ..core.conventions import CULLED
from ..core.emitters import sampling_density
from ..core.errors import Cancelled
from ..core.grid import Grid
from ..core.probe_edits import ProbeEdits
from ..core.settings import BakeSettings
from ..core.snapshot import SceneSnapshot
from ..core.steps import run
from ..gpu_shaders.scene_textures import SceneTextures
from .cost import CostModel, Line

_SIZES = (8, 128, 512)  # nodes; the first only compiles shaders. Smaller grids than 128 have patches of their own size


def calibrate(
    snapshot: SceneSnapshot, grid: Grid, settings: BakeSettings, should_stop: Callable[[], bool]
) -> CostModel:
    """Needs a GPU context. Raises Cancelled."""
    see, settle, sizes = [], [], []
    started = time.perf_counter()
    scene = SceneTextures(snapshot, grid.center, sampling_density(snapshot, grid))
    scene_seconds = time.perf_counter() - started
    edits = ProbeEdits.none(grid)
    state = cull(snapshot, grid, settings, edits)
    capture = choose_capture(settings, scene.triangle_count, int((state != CULLED).sum()))[0]
    for most in _SIZES:
        ground = BlockGround(BakeJob(snapshot, grid, replace(settings, block=most), edits), state, scene, capture)
        block = max(ground.blocks, key=lambda block: len(ground.captured(block)))
        times = _bake(ground, block, should_stop)
        if most > _SIZES[0] or len(ground.blocks) == 1:
            see.append(times[0])
            settle.append(times[1])
            sizes.append(len(ground.captured(block)))
        if len(ground.blocks) == 1:
            break  # the whole grid is no larger
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024  # kibibytes on Linux
    return CostModel(Line.through(sizes, see), Line.through(sizes, settle), scene_seconds, peak)


def _bake(ground: BlockGround, block: Block, should_stop: Callable[[], bool]) -> tuple[float, float]:
    """Seconds of both iterations of ``block``."""
    started = time.perf_counter()
    bake = run(ground.open(block))
    votes = run(ground.see(bake))
    seen = time.perf_counter()
    if should_stop():
        raise Cancelled("cancelled")
    run(ground.settle(bake, votes))
    return seen - started, time.perf_counter() - seen
